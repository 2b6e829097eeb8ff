//! The Walsh–Hadamard transform of the bits of a block: sums and differences only. It makes the mixer
//! `e^{−iβ ΣX}` diagonal, with eigenvalue `e^{−iβ(n − 2|k|)}` where |k| counts the ones of k.

use super::vector::{LANES, Vector};

/// Transforms the bits `stride` (in vectors) and up of a block.
#[inline(always)]
fn outer_bits<V: Vector>(block: &mut [V], stride: usize) {
    let mut reach = block.len();
    while reach >= 8 * stride {
        three_bits(block, reach / 8);
        reach /= 8;
    }
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
            [*a, *b, *c, *d] = four_rows(*a, *b, *c, *d);
        }
    }
}

#[inline(always)]
fn three_bits<V: Vector>(block: &mut [V], stride: usize) {
    for group in block.chunks_exact_mut(8 * stride) {
        let (low, high) = group.split_at_mut(4 * stride);
        let ((a, b), (c, d)) = halves(low, stride);
        let ((e, f), (g, h)) = halves(high, stride);
        let low = a.iter_mut().zip(b).zip(c.iter_mut().zip(d));
        let high = e.iter_mut().zip(f).zip(g.iter_mut().zip(h));
        for (((a, b), (c, d)), ((e, f), (g, h))) in low.zip(high) {
            [*a, *b, *c, *d, *e, *f, *g, *h] = eight_rows([*a, *b, *c, *d, *e, *f, *g, *h]);
        }
    }
}

type Pair<'a, V> = (&'a mut [V], &'a mut [V]);

#[inline(always)]
fn halves<V>(group: &mut [V], stride: usize) -> (Pair<'_, V>, Pair<'_, V>) {
    let (low, high) = group.split_at_mut(2 * stride);
    (low.split_at_mut(stride), high.split_at_mut(stride))
}

/// Transforms eight vectors over rows and columns, which change places.
#[inline(always)]
fn transform_square<V: Vector>(rows: &mut [V]) {
    let [a, b, c, d, e, f, g, h] =
        eight_rows([rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7]]);
    let ((a, b), (c, d)) = (a.by_ones(b), c.by_ones(d));
    let ((e, f), (g, h)) = (e.by_ones(f), g.by_ones(h));
    let ((a, c), (b, d)) = (a.by_twos(c), b.by_twos(d));
    let ((e, g), (f, h)) = (e.by_twos(g), f.by_twos(h));
    let ((a, e), (b, f)) = (a.by_fours(e), b.by_fours(f));
    let ((c, g), (d, h)) = (c.by_fours(g), d.by_fours(h));
    rows.copy_from_slice(&eight_rows([a, b, c, d, e, f, g, h]));
}

#[inline(always)]
fn four_rows<V: Vector>(a: V, b: V, c: V, d: V) -> [V; 4] {
    let (s, t, u, v) = (a + b, a - b, c + d, c - d);
    [s + u, t + v, s - u, t - v]
}

#[inline(always)]
fn eight_rows<V: Vector>([a, b, c, d, e, f, g, h]: [V; 8]) -> [V; 8] {
    let [a, b, c, d] = four_rows(a, b, c, d);
    let [e, f, g, h] = four_rows(e, f, g, h);
    [a + e, b + f, c + g, d + h, a - e, b - f, c - g, d - h]
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
    outer_bits(block, LANES);
    for square in block.chunks_exact_mut(LANES) {
        transform_square(square);
    }
}

/// Transforms back (up to the factor 2^bits), the bits in their own places again.
#[inline(always)]
pub(super) fn backward<V: Vector>(block: &mut [V]) {
    for square in block.chunks_exact_mut(LANES) {
        transform_square(square);
    }
    outer_bits(block, LANES);
}

#[cfg(test)]
mod tests {
    use super::super::vector::{D8, S8};
    use super::*;

    fn is_a_walsh_transform<V: Vector>(bits: usize) {
        let size = 1 << bits;
        let value = |index: usize| ((index * 37 + 11) % 101) as f64 - 50.0;
        let mut block: Vec<V> =
            (0..size / LANES).map(|b| V::from_fn(|lane| value(b * LANES + lane))).collect();
        forward(&mut block);
        for (b, vector) in block.iter().enumerate() {
            for lane in 0..LANES {
                // Undo the exchange of lane and row.
                let (group, row) = (b / LANES, b % LANES);
                let k = (group * LANES + lane) * LANES + row;
                let sign =
                    |x: usize| if (k & x).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
                let expected: f64 = (0..size).map(|x| sign(x) * value(x)).sum();
                assert_eq!(vector.lane(lane), expected);
            }
        }
        backward(&mut block);
        for (b, vector) in block.iter().enumerate() {
            for lane in 0..LANES {
                assert_eq!(vector.lane(lane), size as f64 * value(b * LANES + lane));
            }
        }
    }

    #[test]
    fn the_transform_follows_its_definition_and_inverts_itself() {
        for bits in [6, 7, 8, 9] {
            is_a_walsh_transform::<D8>(bits);
            is_a_walsh_transform::<S8>(bits);
        }
    }
}
