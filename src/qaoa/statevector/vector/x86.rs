//! Eight numbers in the registers of x86-64 processors: two of AVX2's for doubles, one of AVX-512's where
//! there are such, and one of AVX2's for singles.
//!
//! Safety of all intrinsics here: these types are made and used by an `Evolution` only, which chooses them
//! after the processor has said that it has what they need.
// Exchanging fours needs no instruction where a vector is two registers.
#![allow(unsafe_code, unused_unsafe)]

use std::arch::x86_64 as x86;
use std::arch::x86_64::{__m256, __m256d, __m512d};
use std::mem::transmute;
use std::ops::{Add, AddAssign, Mul, Sub};

use super::super::super::simd::{self, Kernel};
use super::Vector;

macro_rules! vector {
    ($(#[$doc:meta])* $name:ident($register:ty), $scalar:ty, $compiled:path {
        add: |$a:pat_param, $b:pat_param| $add:expr,
        sub: |$c:pat_param, $d:pat_param| $sub:expr,
        mul: |$e:pat_param, $f:pat_param| $mul:expr,
        by_ones: |$g:pat_param, $h:pat_param| $ones:expr,
        by_twos: |$i:pat_param, $j:pat_param| $twos:expr,
        by_fours: |$k:pat_param, $l:pat_param| $fours:expr,
    }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub(in super::super) struct $name($register);

        impl $name {
            #[inline(always)]
            fn new(lanes: [$scalar; 8]) -> Self {
                // SAFETY: eight numbers either way.
                unsafe { transmute(lanes) }
            }

            #[inline(always)]
            fn lanes(self) -> [$scalar; 8] {
                // SAFETY: eight numbers either way.
                unsafe { transmute(self) }
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self::ZERO
            }
        }

        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                let ($a, $b) = (self.0, other.0);
                // SAFETY: the processor has the instruction; see the module.
                Self(unsafe { $add })
            }
        }

        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                let ($c, $d) = (self.0, other.0);
                // SAFETY: the processor has the instruction; see the module.
                Self(unsafe { $sub })
            }
        }

        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                let ($e, $f) = (self.0, other.0);
                // SAFETY: the processor has the instruction; see the module.
                Self(unsafe { $mul })
            }
        }

        impl AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl Vector for $name {
            // SAFETY: zeros are numbers.
            const ZERO: Self = unsafe { transmute([0.0 as $scalar; 8]) };

            #[inline(always)]
            fn run<K: Kernel>(kernel: K) -> K::Output {
                // SAFETY: the processor has the instructions; see the module.
                unsafe { $compiled(kernel) }
            }

            #[inline(always)]
            fn splat(value: f64) -> Self {
                Self::new([value as $scalar; 8])
            }

            #[inline(always)]
            fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
                let mut lanes = [0.0; 8];
                for (lane, out) in lanes.iter_mut().enumerate() {
                    *out = value(lane) as $scalar;
                }
                Self::new(lanes)
            }

            #[inline(always)]
            fn lane(self, lane: usize) -> f64 {
                f64::from(self.lanes()[lane])
            }

            #[inline(always)]
            fn sum(self) -> f64 {
                let [a, b, c, d, e, f, g, h] = self.lanes();
                f64::from((a + b) + (c + d)) + f64::from((e + f) + (g + h))
            }

            #[inline(always)]
            fn by_ones(self, other: Self) -> (Self, Self) {
                let ($g, $h) = (self.0, other.0);
                // SAFETY: the processor has the instructions; see the module.
                let (first, second) = unsafe { $ones };
                (Self(first), Self(second))
            }

            #[inline(always)]
            fn by_twos(self, other: Self) -> (Self, Self) {
                let ($i, $j) = (self.0, other.0);
                // SAFETY: the processor has the instructions; see the module.
                let (first, second) = unsafe { $twos };
                (Self(first), Self(second))
            }

            #[inline(always)]
            fn by_fours(self, other: Self) -> (Self, Self) {
                let ($k, $l) = (self.0, other.0);
                // SAFETY: the processor has the instructions; see the module.
                let (first, second) = unsafe { $fours };
                (Self(first), Self(second))
            }
        }
    };
}

vector! {
    /// Eight doubles in one register. Needs AVX-512F and VL.
    D8Wide(__m512d), f64, simd::x86::with_avx512 {
        add: |a, b| x86::_mm512_add_pd(a, b),
        sub: |a, b| x86::_mm512_sub_pd(a, b),
        mul: |a, b| x86::_mm512_mul_pd(a, b),
        by_ones: |a, b| (x86::_mm512_unpacklo_pd(a, b), x86::_mm512_unpackhi_pd(a, b)),
        by_twos: |a, b| {
            let first = x86::_mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let second = x86::_mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            (x86::_mm512_permutex2var_pd(a, first, b), x86::_mm512_permutex2var_pd(a, second, b))
        },
        by_fours: |a, b| {
            (x86::_mm512_shuffle_f64x2::<0x44>(a, b), x86::_mm512_shuffle_f64x2::<0xEE>(a, b))
        },
    }
}

vector! {
    /// Eight doubles in two registers. Needs AVX2.
    D4x2([__m256d; 2]), f64, simd::x86::with_avx2 {
        add: |[a, b], [c, d]| {
            [x86::_mm256_add_pd(a, c), x86::_mm256_add_pd(b, d)]
        },
        sub: |[a, b], [c, d]| {
            [x86::_mm256_sub_pd(a, c), x86::_mm256_sub_pd(b, d)]
        },
        mul: |[a, b], [c, d]| {
            [x86::_mm256_mul_pd(a, c), x86::_mm256_mul_pd(b, d)]
        },
        by_ones: |[a, b], [c, d]| {
            (
                [x86::_mm256_unpacklo_pd(a, c), x86::_mm256_unpacklo_pd(b, d)],
                [x86::_mm256_unpackhi_pd(a, c), x86::_mm256_unpackhi_pd(b, d)],
            )
        },
        by_twos: |[a, b], [c, d]| {
            (
                [
                    x86::_mm256_permute2f128_pd::<0x20>(a, c),
                    x86::_mm256_permute2f128_pd::<0x20>(b, d),
                ],
                [
                    x86::_mm256_permute2f128_pd::<0x31>(a, c),
                    x86::_mm256_permute2f128_pd::<0x31>(b, d),
                ],
            )
        },
        by_fours: |[a, b], [c, d]| ([a, c], [b, d]),
    }
}

vector! {
    /// Eight singles in one register. Needs AVX2.
    S8Wide(__m256), f32, simd::x86::with_avx2 {
        add: |a, b| x86::_mm256_add_ps(a, b),
        sub: |a, b| x86::_mm256_sub_ps(a, b),
        mul: |a, b| x86::_mm256_mul_ps(a, b),
        by_ones: |a, b| (
            x86::_mm256_blend_ps::<0xAA>(a, x86::_mm256_moveldup_ps(b)),
            x86::_mm256_blend_ps::<0xAA>(x86::_mm256_movehdup_ps(a), b),
        ),
        by_twos: |a, b| {
            (x86::_mm256_shuffle_ps::<0x44>(a, b), x86::_mm256_shuffle_ps::<0xEE>(a, b))
        },
        by_fours: |a, b| {
            (x86::_mm256_permute2f128_ps::<0x20>(a, b), x86::_mm256_permute2f128_ps::<0x31>(a, b))
        },
    }
}
