//! [`Vector`]: the numbers of one vector register, in double or single precision, so that every kernel
//! is written once.

use std::ops::{Add, AddAssign, Mul, Sub};

use super::super::simd::F4;

/// A few numbers next to each other.
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
    /// How many; a power of two.
    const LANES: usize;
    /// All zero.
    const ZERO: Self;

    /// The same number in every lane.
    fn splat(value: f64) -> Self;
    /// One number per lane.
    fn from_fn(value: impl FnMut(usize) -> f64) -> Self;
    /// The number in one lane.
    fn lane(self, lane: usize) -> f64;
    /// The sum over all lanes.
    fn sum(self) -> f64;
    /// `LANES` vectors as a square: rows become columns.
    fn transpose(rows: &mut [Self]);
}

impl Vector for F4 {
    const LANES: usize = 4;
    const ZERO: Self = F4::ZERO;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        Self([value(0), value(1), value(2), value(3)])
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.0[lane]
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        F4::sum(self)
    }

    #[inline(always)]
    fn transpose(rows: &mut [Self]) {
        let square = F4::transpose([rows[0], rows[1], rows[2], rows[3]]);
        rows.copy_from_slice(&square);
    }
}

/// Eight numbers in single precision.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(32))]
pub(super) struct S8([f32; 8]);

macro_rules! lane_by_lane {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for S8 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let (Self([a, b, c, d, e, f, g, h]), Self([i, j, k, l, m, n, o, p])) = (self, other);
                Self([
                    a $operator i, b $operator j, c $operator k, d $operator l,
                    e $operator m, f $operator n, g $operator o, h $operator p,
                ])
            }
        }
    };
}

lane_by_lane!(Add, add, +);
lane_by_lane!(Sub, sub, -);
lane_by_lane!(Mul, mul, *);

impl AddAssign for S8 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Vector for S8 {
    const LANES: usize = 8;
    const ZERO: Self = Self([0.0; 8]);

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value as f32; 8])
    }

    #[inline(always)]
    fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        let mut lanes = [0.0; 8];
        for (lane, out) in lanes.iter_mut().enumerate() {
            *out = value(lane) as f32;
        }
        Self(lanes)
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        f64::from(self.0[lane])
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        let Self([a, b, c, d, e, f, g, h]) = self;
        f64::from((a + b) + (c + d)) + f64::from((e + f) + (g + h))
    }

    #[inline(always)]
    fn transpose(rows: &mut [Self]) {
        // Two by two, four by four, eight by eight: exchange the off-diagonal parts.
        for (half, mask) in [(1, 0b0101_0101), (2, 0b0011_0011), (4, 0b0000_1111)] {
            for row in 0..8 {
                if row & half == 0 {
                    let (Self(a), Self(b)) = (rows[row], rows[row + half]);
                    let (mut upper, mut lower) = (a, b);
                    for lane in 0..8 {
                        if mask >> lane & 1 == 0 {
                            upper[lane] = b[lane - half];
                        } else {
                            lower[lane] = a[lane + half];
                        }
                    }
                    (rows[row], rows[row + half]) = (Self(upper), Self(lower));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transposes<V: Vector>() {
        let entry = |row: usize, column: usize| (10 * row + column) as f64;
        let mut rows: Vec<V> = (0..V::LANES).map(|r| V::from_fn(|c| entry(r, c))).collect();
        V::transpose(&mut rows);
        for (row, vector) in rows.iter().enumerate() {
            for column in 0..V::LANES {
                assert_eq!(vector.lane(column), entry(column, row));
            }
        }
    }

    #[test]
    fn rows_become_columns_in_both_precisions() {
        transposes::<F4>();
        transposes::<S8>();
    }
}
