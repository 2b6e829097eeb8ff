//! Eight numbers in plain Rust, for every processor.

use std::ops::{Add, AddAssign, Mul, Sub};

use super::super::super::simd::Kernel;
use super::Vector;

macro_rules! eight_lanes {
    ($name:ident, $scalar:ty, $align:literal, $doc:literal) => {
        #[doc = $doc]
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        #[repr(align($align))]
        pub(in super::super) struct $name([$scalar; 8]);

        eight_lanes!(operator $name, Add, add, +);
        eight_lanes!(operator $name, Sub, sub, -);
        eight_lanes!(operator $name, Mul, mul, *);

        impl AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl Vector for $name {
            const ZERO: Self = Self([0.0; 8]);

            #[inline(always)]
            fn run<K: Kernel>(kernel: K) -> K::Output {
                kernel.run()
            }

            #[inline(always)]
            fn splat(value: f64) -> Self {
                Self([value as $scalar; 8])
            }

            #[inline(always)]
            fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
                let mut lanes = [0.0; 8];
                for (lane, out) in lanes.iter_mut().enumerate() {
                    *out = value(lane) as $scalar;
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
            fn by_ones(self, other: Self) -> (Self, Self) {
                let (a, b) = (self.0, other.0);
                (
                    Self([a[0], b[0], a[2], b[2], a[4], b[4], a[6], b[6]]),
                    Self([a[1], b[1], a[3], b[3], a[5], b[5], a[7], b[7]]),
                )
            }

            #[inline(always)]
            fn by_twos(self, other: Self) -> (Self, Self) {
                let (a, b) = (self.0, other.0);
                (
                    Self([a[0], a[1], b[0], b[1], a[4], a[5], b[4], b[5]]),
                    Self([a[2], a[3], b[2], b[3], a[6], a[7], b[6], b[7]]),
                )
            }

            #[inline(always)]
            fn by_fours(self, other: Self) -> (Self, Self) {
                let (a, b) = (self.0, other.0);
                (
                    Self([a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]),
                    Self([a[4], a[5], a[6], a[7], b[4], b[5], b[6], b[7]]),
                )
            }
        }
    };
    (operator $name:ident, $trait:ident, $method:ident, $operator:tt) => {
        impl $trait for $name {
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

eight_lanes!(D8, f64, 64, "Eight numbers in double precision.");
eight_lanes!(S8, f32, 32, "Eight numbers in single precision.");
