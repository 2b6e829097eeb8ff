//! Arithmetic on four numbers at once, and the one place where the processor is asked what it can do.
//!
//! Kernels are written in plain Rust over [`F4`]; [`run`] has them compiled again for AVX2 and AVX-512.
//! No operation is fused or reordered by that, so results are the same to the last bit on every processor.
//! Closures and the array methods that take them are avoided in kernels: they are not always inlined,
//! and then not compiled for these.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// Four numbers, one vector register on processors that have such.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(32))]
pub(super) struct F4(pub(super) [f64; 4]);

impl F4 {
    pub(super) const ZERO: Self = Self([0.0; 4]);
    pub(super) const ONE: Self = Self([1.0; 4]);

    #[inline(always)]
    pub(super) fn splat(value: f64) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    pub(super) fn sum(self) -> f64 {
        let [a, b, c, d] = self.0;
        (a + b) + (c + d)
    }

    /// Rows become columns.
    #[inline(always)]
    pub(super) fn transpose(rows: [Self; 4]) -> [Self; 4] {
        let [Self(a), Self(b), Self(c), Self(d)] = rows;
        [
            Self([a[0], b[0], c[0], d[0]]),
            Self([a[1], b[1], c[1], d[1]]),
            Self([a[2], b[2], c[2], d[2]]),
            Self([a[3], b[3], c[3], d[3]]),
        ]
    }
}

impl Add for F4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (Self([a, b, c, d]), Self([e, f, g, h])) = (self, other);
        Self([a + e, b + f, c + g, d + h])
    }
}

impl Sub for F4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (Self([a, b, c, d]), Self([e, f, g, h])) = (self, other);
        Self([a - e, b - f, c - g, d - h])
    }
}

impl Mul for F4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (Self([a, b, c, d]), Self([e, f, g, h])) = (self, other);
        Self([a * e, b * f, c * g, d * h])
    }
}

impl Mul<F4> for f64 {
    type Output = F4;
    #[inline(always)]
    fn mul(self, other: F4) -> F4 {
        F4::splat(self) * other
    }
}

impl Neg for F4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let Self([a, b, c, d]) = self;
        Self([-a, -b, -c, -d])
    }
}

impl AddAssign for F4 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Four complex numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct C4 {
    pub(super) re: F4,
    pub(super) im: F4,
}

impl C4 {
    /// Multiplied by the imaginary unit.
    #[inline(always)]
    pub(super) fn times_i(self) -> Self {
        Self { re: -self.im, im: self.re }
    }
}

impl Add for C4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl Sub for C4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl Mul for C4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }
}

impl Mul<C4> for F4 {
    type Output = C4;
    #[inline(always)]
    fn mul(self, other: C4) -> C4 {
        C4 { re: self * other.re, im: self * other.im }
    }
}

impl Mul<C4> for f64 {
    type Output = C4;
    #[inline(always)]
    fn mul(self, other: C4) -> C4 {
        F4::splat(self) * other
    }
}

/// Work to be compiled for several instruction sets: `run` and all it calls must be `#[inline(always)]`.
pub(super) trait Kernel {
    /// What the work returns.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// Runs a kernel with the widest instructions this processor has.
pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if has_avx512() {
            // SAFETY: the processor has just said that it has both.
            #[allow(unsafe_code)]
            return unsafe { x86::with_avx512(kernel) };
        }
        if has_avx2() {
            // SAFETY: the processor has just said that it has AVX2.
            #[allow(unsafe_code)]
            return unsafe { x86::with_avx2(kernel) };
        }
    }
    kernel.run()
}

/// Whether this processor has AVX-512 with vectors of all lengths.
#[cfg(target_arch = "x86_64")]
pub(super) fn has_avx512() -> bool {
    std::is_x86_feature_detected!("avx512f") && std::is_x86_feature_detected!("avx512vl")
}

/// Whether this processor has AVX2.
#[cfg(target_arch = "x86_64")]
pub(super) fn has_avx2() -> bool {
    std::is_x86_feature_detected!("avx2")
}

/// Kernels compiled for some of the instruction sets of x86-64.
#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use super::Kernel;

    /// For AVX-512F and VL, which the processor must have.
    #[target_feature(enable = "avx512f,avx512vl")]
    pub(in super::super) fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }

    /// For AVX2, which the processor must have.
    #[target_feature(enable = "avx2")]
    pub(in super::super) fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Chaotic(F4);

    impl Kernel for Chaotic {
        type Output = F4;
        #[inline(always)]
        fn run(self) -> F4 {
            let mut x = self.0;
            for _ in 0..1000 {
                x = 3.9 * x * (F4::ONE - x);
            }
            x
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let start = F4([0.1, 0.2, 0.3, 0.4]);
        assert_eq!(run(Chaotic(start)), Chaotic(start).run());
    }

    #[test]
    fn transposing_twice_changes_nothing() {
        let rows = [0.0, 4.0, 8.0, 12.0].map(|i| F4([i, i + 1.0, i + 2.0, i + 3.0]));
        assert_eq!(F4::transpose(rows)[1], F4([1.0, 5.0, 9.0, 13.0]));
        assert_eq!(F4::transpose(F4::transpose(rows)), rows);
    }
}
