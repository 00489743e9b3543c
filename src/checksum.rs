//! Checksums: of what may lie in a file CRC-32 (ISO-HDLC, as in zip and PNG), of scenes a faster one.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

use crate::scattered::scattered;

/// One table has 1 kB. Sixteen are several times as fast, and their code has paths to a panic.
static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Of the bytes of a file.
pub(crate) fn crc_32(bytes: &[u8]) -> u32 {
    crc_32_of([bytes])
}

/// Of those of parts that follow each other.
pub(crate) fn crc_32_of<const N: usize>(parts: [&[u8]; N]) -> u32 {
    let mut digest = CRC.digest();
    parts.iter().for_each(|part| digest.update(part));
    digest.finalize()
}

/// Of tables that follow each other: any change of one gives another number, but for one in 4e9.
pub(crate) struct OfTables(u64);

impl OfTables {
    pub(crate) const fn new() -> Self {
        // Not zero, which zeros would leave as it is. The first step of SplitMix64.
        Self(0x9e37_79b9_7f4a_7c15)
    }

    pub(crate) fn update(&mut self, bytes: &[u8]) {
        let (whole, rest) = bytes.as_chunks::<8>();
        let mut last = [0; 8];
        for (to, from) in last.iter_mut().zip(rest) {
            *to = *from;
        }
        let numbers = whole.iter().chain([&last]).map(|&eight| u64::from_le_bytes(eight));
        self.0 = numbers.chain([bytes.len() as u64]).fold(self.0, |sum, number| scattered(sum ^ number));
    }

    pub(crate) const fn number(&self) -> u32 {
        self.0 as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of each bit, each length, and how the tables are cut.
    #[test]
    fn every_change_of_a_table_changes_the_number() {
        let of = |tables: &[&[u8]]| {
            let mut sum = OfTables::new();
            tables.iter().for_each(|table| sum.update(table));
            sum.number()
        };
        let table: std::vec::Vec<u8> = (0..100).collect();
        let mut seen = std::collections::BTreeSet::from([of(&[&table])]);
        for bit in 0..800 {
            let mut other = table.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            seen.insert(of(&[&other]));
        }
        for length in 0..100 {
            seen.insert(of(&[&table[..length]]));
            seen.insert(of(&[&table[..length], &table[length..]]));
        }
        assert_eq!(seen.len(), 1 + 800 + 200);
        assert_eq!(crc_32(b"123456789"), 0xcbf4_3926);
    }
}
