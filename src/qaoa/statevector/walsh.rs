//! The Walsh–Hadamard transform of the bits of a block: sums and differences only. It makes the mixer
//! `e^{−iβ ΣX}` diagonal, with eigenvalue `e^{−iβ(n − 2|k|)}` where |k| counts the ones of k.

use super::vector::Vector;

/// Transforms the bits `stride` (in vectors) and up of a block.
#[inline(always)]
fn outer_bits<V: Vector>(block: &mut [V], stride: usize) {
    let mut reach = block.len();
    while reach >= 4 * stride {
        two_bits(block, reach / 4);
        reach /= 4;
    }
    if reach == 2 * stride {
        one_bit(block, stride);
    }
}

#[inline(always)]
fn one_bit<V: Vector>(block: &mut [V], stride: usize) {
    for pair in block.chunks_exact_mut(2 * stride) {
        let (low, high) = pair.split_at_mut(stride);
        for (x, y) in low.iter_mut().zip(high) {
            (*x, *y) = (*x + *y, *x - *y);
        }
    }
}

#[inline(always)]
fn two_bits<V: Vector>(block: &mut [V], stride: usize) {
    for group in block.chunks_exact_mut(4 * stride) {
        let (first, rest) = group.split_at_mut(stride);
        let (second, rest) = rest.split_at_mut(stride);
        let (third, fourth) = rest.split_at_mut(stride);
        for (((a, b), c), d) in first.iter_mut().zip(second).zip(third).zip(fourth) {
            let (s, t, u, v) = (*a + *b, *a - *b, *c + *d, *c - *d);
            (*a, *b, *c, *d) = (s + u, t + v, s - u, t - v);
        }
    }
}

/// Transforms the rows of a block of `width` vectors each; columns stay apart.
#[inline(always)]
pub(super) fn columns<V: Vector>(block: &mut [V], width: usize) {
    outer_bits(block, width);
}

/// Transforms all bits of a block of at least `LANES` vectors. The bits within a vector change places
/// with the next higher ones.
#[inline(always)]
pub(super) fn forward<V: Vector>(block: &mut [V]) {
    outer_bits(block, V::LANES);
    for square in block.chunks_exact_mut(V::LANES) {
        outer_bits(square, 1);
        V::transpose(square);
        outer_bits(square, 1);
    }
}

/// Transforms back (up to the factor 2^bits), the bits in their own places again.
#[inline(always)]
pub(super) fn backward<V: Vector>(block: &mut [V]) {
    for square in block.chunks_exact_mut(V::LANES) {
        outer_bits(square, 1);
        V::transpose(square);
        outer_bits(square, 1);
    }
    outer_bits(block, V::LANES);
}

#[cfg(test)]
mod tests {
    use super::super::super::simd::F4;
    use super::super::vector::S8;
    use super::*;

    fn is_a_walsh_transform<V: Vector>(bits: usize) {
        let size = 1 << bits;
        let value = |index: usize| ((index * 37 + 11) % 101) as f64 - 50.0;
        let mut block: Vec<V> =
            (0..size / V::LANES).map(|b| V::from_fn(|lane| value(b * V::LANES + lane))).collect();
        forward(&mut block);
        for (b, vector) in block.iter().enumerate() {
            for lane in 0..V::LANES {
                // Undo the exchange of lane and row.
                let (group, row) = (b / V::LANES, b % V::LANES);
                let k = (group * V::LANES + lane) * V::LANES + row;
                let sign =
                    |x: usize| if (k & x).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
                let expected: f64 = (0..size).map(|x| sign(x) * value(x)).sum();
                assert_eq!(vector.lane(lane), expected);
            }
        }
        backward(&mut block);
        for (b, vector) in block.iter().enumerate() {
            for lane in 0..V::LANES {
                assert_eq!(vector.lane(lane), size as f64 * value(b * V::LANES + lane));
            }
        }
    }

    #[test]
    fn the_transform_follows_its_definition_and_inverts_itself() {
        for bits in [6, 7, 8, 9] {
            is_a_walsh_transform::<F4>(bits);
            is_a_walsh_transform::<S8>(bits);
        }
    }
}
