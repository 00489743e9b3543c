//! Heap sort, in place and without a heap of the host: the sort of the standard library can panic.

/// Sorts a list by a key of its entries, those with equal keys in any order.
pub(crate) fn sort<T: Copy, K: Ord>(list: &mut [T], key: impl Fn(T) -> K) {
    let count = list.len();
    for root in (0..count / 2).rev() {
        sift(list, root, count, &key);
    }
    for end in (1..count).rev() {
        exchange(list, 0, end);
        sift(list, 0, end, &key);
    }
}

/// Lets the entry at `root` sink into the heap of the first `end` entries.
fn sift<T: Copy, K: Ord>(list: &mut [T], mut root: usize, end: usize, key: &impl Fn(T) -> K) {
    let key_at = |list: &[T], at: usize| list.get(at).filter(|_| at < end).map(|&entry| key(entry));
    while 2 * root + 1 < end {
        let mut child = 2 * root + 1;
        if key_at(list, child) < key_at(list, child + 1) {
            child += 1;
        }
        if key_at(list, root) >= key_at(list, child) {
            return;
        }
        exchange(list, root, child);
        root = child;
    }
}

fn exchange<T: Copy>(list: &mut [T], a: usize, b: usize) {
    if let (Some(&first), Some(&second)) = (list.get(a), list.get(b)) {
        list.get_mut(a).into_iter().for_each(|entry| *entry = second);
        list.get_mut(b).into_iter().for_each(|entry| *entry = first);
    }
}

#[cfg(test)]
mod tests {
    use super::sort;

    #[test]
    fn sorts() {
        let mut list: Vec<u32> = (0..1000u32).map(|at| at.wrapping_mul(2_654_435_761) % 977).collect();
        let mut expected = list.clone();
        expected.sort_by_key(|&entry| std::cmp::Reverse(entry));
        sort(&mut list, std::cmp::Reverse);
        assert_eq!(list, expected);
    }
}
