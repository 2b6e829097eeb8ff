//! [`Bits`]: a bitstring over any number of qubits. Qubit 0 is written first and bit 0 means z = +1.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// A bitstring, one bit per qubit; ordered as its text is (qubit 0 is the most significant).
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Bits {
    /// Qubit `q` sits in word `q / 64`, counted from the top bit, so that words compare like text.
    words: Vec<u64>,
    len: usize,
}

/// Text that is not a bitstring.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("character {position} of a bitstring is {found:?}; write 0 or 1 only")]
pub struct ParseBitsError {
    position: usize,
    found: char,
}

impl Bits {
    /// All qubits 0 (every z = +1).
    #[must_use]
    pub fn zeros(len: usize) -> Self {
        Self { words: vec![0; len.div_ceil(64)], len }
    }

    /// The bitstring whose qubit `q` is `bit(q)`.
    #[must_use]
    pub fn from_fn(len: usize, mut bit: impl FnMut(usize) -> bool) -> Self {
        let mut bits = Self::zeros(len);
        for qubit in 0..len {
            bits.set(qubit, bit(qubit));
        }
        bits
    }

    /// The bitstring of a computational basis state whose qubit `q` is binary digit `q` (little
    /// endian, as the statevector engine numbers its amplitudes).
    #[must_use]
    pub fn from_index(len: usize, index: usize) -> Self {
        Self::from_fn(len, |qubit| index >> qubit & 1 == 1)
    }

    /// How many qubits.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no qubit at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The bit of one qubit; `false` beyond the end.
    #[must_use]
    pub fn get(&self, qubit: usize) -> bool {
        self.words.get(qubit / 64).is_some_and(|word| word << (qubit % 64) >> 63 == 1)
    }

    /// Sets the bit of one qubit; a qubit beyond the end is left alone.
    pub fn set(&mut self, qubit: usize, bit: bool) {
        if qubit < self.len {
            let mask = 1 << (63 - qubit % 64);
            let word = &mut self.words[qubit / 64];
            *word = if bit { *word | mask } else { *word & !mask };
        }
    }

    /// The qubit's eigenvalue of Z: +1 for bit 0, −1 for bit 1.
    #[must_use]
    pub fn z(&self, qubit: usize) -> f64 {
        if self.get(qubit) { -1.0 } else { 1.0 }
    }

    /// The bits from qubit 0 on.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        (0..self.len).map(|qubit| self.get(qubit))
    }
}

impl fmt::Display for Bits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text: String = self.iter().map(|bit| if bit { '1' } else { '0' }).collect();
        f.pad(&text)
    }
}

impl FromStr for Bits {
    type Err = ParseBitsError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut bits = Self::zeros(text.chars().count());
        for (position, found) in text.chars().enumerate() {
            match found {
                '0' => {}
                '1' => bits.set(position, true),
                _ => return Err(ParseBitsError { position, found }),
            }
        }
        Ok(bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_survives_the_round_trip_across_word_boundaries() {
        for len in [0, 1, 63, 64, 65, 130] {
            let bits = Bits::from_fn(len, |qubit| qubit * qubit % 7 < 3);
            assert_eq!(bits.to_string().parse::<Bits>(), Ok(bits.clone()));
            assert_eq!(bits.len(), len);
        }
    }

    #[test]
    fn qubit_zero_is_written_first_and_orders_first() {
        let bits: Bits = "100".parse().unwrap();
        assert!(bits.get(0) && !bits.get(2));
        assert_eq!(bits.z(0), -1.0);
        assert!(bits > "011".parse().unwrap());
        assert_eq!(Bits::from_index(3, 1), bits);
    }

    #[test]
    fn anything_but_zero_and_one_is_refused() {
        assert_eq!("01x".parse::<Bits>(), Err(ParseBitsError { position: 2, found: 'x' }));
    }
}
