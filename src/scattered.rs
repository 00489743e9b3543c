//! Numbers with well mixed bits, to tell states and faces apart by one number.

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): other bits for each other number, half of them on average.
pub(crate) const fn scattered(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}
