//! LZF, the compression of PCD files: runs of literal bytes, and copies from up to 8 KiB before.

/// The unpacked bytes of `packed`; `None` for another length than `len`, or a copy from before the
/// start.
///
/// - `len`: checked against memory by the caller.
pub(super) fn unpacked(packed: &[u8], len: usize) -> Option<Vec<u8>> {
    /// Control bytes below this announce literals.
    const LITERALS: u8 = 32;
    let mut out = Vec::with_capacity(len);
    let mut rest = packed;
    while let Some((&control, after)) = rest.split_first() {
        rest = after;
        if control < LITERALS {
            let (run, after) = rest.split_at_checked(usize::from(control) + 1)?;
            out.extend_from_slice(run);
            rest = after;
        } else {
            let mut next = || {
                let (&byte, after) = rest.split_first()?;
                rest = after;
                Some(usize::from(byte))
            };
            let more = if control >> 5 == 7 { next()? } else { 0 };
            let count = usize::from(control >> 5) + 2 + more;
            let back = (usize::from(control & 0x1f) << 8) + next()? + 1;
            let from = out.len().checked_sub(back)?;
            // a copy may overlap its own output
            (from..from + count).for_each(|at| out.push(out[at]));
        }
        if out.len() > len {
            return None;
        }
    }
    (out.len() == len).then_some(out)
}

/// Maximum expansion of a packed byte: three make a copy of 264.
pub(super) const MOST_EXPANSION: u64 = 88;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_copies_are_unpacked_and_anything_else_is_refused() {
        // three literals, then five bytes from two back, then nine and three more from one back
        let packed = [2, b'a', b'b', b'c', 3 << 5, 1, 7 << 5, 3, 0];
        let text = b"abcbcbcbbbbbbbbbbbbb".as_slice();
        assert_eq!(unpacked(&packed, text.len()), Some(text.to_vec()));
        assert_eq!(unpacked(&packed, text.len() - 1), None);
        assert_eq!(unpacked(&packed, text.len() + 1), None);
        assert_eq!(
            unpacked(&[1 << 5, 0], 3),
            None,
            "nothing is before the start"
        );
        assert_eq!(unpacked(&[5, b'a'], 6), None, "the literals are cut off");
        assert_eq!(
            unpacked(&[0, b'a', 7 << 5], 10),
            None,
            "the copy is cut off"
        );
    }
}
