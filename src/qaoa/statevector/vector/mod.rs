//! [`Vector`]: eight numbers next to each other, in double or single precision, so that every kernel is
//! written once. `portable` is plain Rust for every processor; `x86` does the same operations with
//! registers as wide as the processor has, where a compiler left to itself takes the eight numbers apart.
//! No operation is fused or reordered: all give the same results to the last bit.

mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::ops::{Add, AddAssign, Mul, Sub};

use super::super::simd::Kernel;
pub(super) use portable::{D8, S8};
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{D4x2, D8Wide, S8Wide};

/// How many numbers a vector holds.
pub(super) const LANES: usize = 8;

/// Eight numbers.
pub(super) trait Vector:
    Copy
    + Default
    + std::fmt::Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + AddAssign
    + 'static
{
    /// All zero.
    const ZERO: Self;

    /// Runs a kernel on such vectors, compiled for the instructions that they need.
    fn run<K: Kernel>(kernel: K) -> K::Output;
    /// The same number in every lane.
    fn splat(value: f64) -> Self;
    /// One number per lane.
    fn from_fn(value: impl FnMut(usize) -> f64) -> Self;
    /// The number in one lane.
    fn lane(self, lane: usize) -> f64;
    /// The sum over all lanes.
    fn sum(self) -> f64;
    /// This vector's even numbers and the other's, then the odd ones of both, in pairs: the first step
    /// of exchanging rows and columns.
    fn by_ones(self, other: Self) -> (Self, Self);
    /// The same for pairs of numbers.
    fn by_twos(self, other: Self) -> (Self, Self);
    /// The same for halves.
    fn by_fours(self, other: Self) -> (Self, Self);
}

#[cfg(test)]
mod tests {
    use super::super::super::simd;
    use super::*;

    fn lanes<V: Vector>(vector: V) -> Vec<f64> {
        (0..LANES).map(|lane| vector.lane(lane)).collect()
    }

    /// Everything a vector can do, as numbers.
    struct All<V>(std::marker::PhantomData<V>);

    impl<V: Vector> Kernel for All<V> {
        type Output = Vec<f64>;

        #[inline(always)]
        fn run(self) -> Vec<f64> {
            let a = V::from_fn(|lane| (lane as f64 + 1.0) / 7.0);
            let b = V::from_fn(|lane| 1.0 / (lane as f64 - 3.5));
            let mut all = lanes(a + b);
            for vector in [a - b, a * b, V::splat(0.3), V::ZERO, V::default()] {
                all.extend(lanes(vector));
            }
            for (x, y) in [a.by_ones(b), a.by_twos(b), a.by_fours(b)] {
                all.extend(lanes(x));
                all.extend(lanes(y));
            }
            all.push((a * b).sum());
            all
        }
    }

    fn all<V: Vector>() -> Vec<f64> {
        V::run(All::<V>(std::marker::PhantomData))
    }

    #[test]
    fn lanes_are_exchanged_as_documented() {
        fn check<V: Vector>() {
            let a = V::from_fn(|lane| lane as f64);
            let b = V::from_fn(|lane| 10.0 + lane as f64);
            let pair = |(x, y): (V, V)| (lanes(x), lanes(y));
            assert_eq!(pair(a.by_ones(b)).0, [0.0, 10.0, 2.0, 12.0, 4.0, 14.0, 6.0, 16.0]);
            assert_eq!(pair(a.by_ones(b)).1, [1.0, 11.0, 3.0, 13.0, 5.0, 15.0, 7.0, 17.0]);
            assert_eq!(pair(a.by_twos(b)).0, [0.0, 1.0, 10.0, 11.0, 4.0, 5.0, 14.0, 15.0]);
            assert_eq!(pair(a.by_fours(b)).1, [4.0, 5.0, 6.0, 7.0, 14.0, 15.0, 16.0, 17.0]);
        }
        check::<D8>();
        check::<S8>();
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn registers_give_what_plain_rust_gives() {
        if simd::has_avx2() {
            assert_eq!(all::<D4x2>(), all::<D8>());
            assert_eq!(all::<S8Wide>(), all::<S8>());
        }
        if simd::has_avx512() {
            assert_eq!(all::<D8Wide>(), all::<D8>());
        }
    }
}
