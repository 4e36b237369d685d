//! A number for each of some vertices, as a binary message: colours of the page beyond `MeshPatch`.

/// Kind of the message.
const VERTEX_NUMBERS: u8 = 2;

/// Quantity of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VertexNumber {
    /// deviation from the nominal part, m; NaN beyond reach
    Deviation = 1,
    /// 1 near a rejected contact; vertices that are not named have none
    Outlier = 3,
}

/// Header: kind, quantity, two zeros, count; then vertices as u32, numbers as f32; little endian.
pub(super) fn frame(which: VertexNumber, numbers: impl Iterator<Item = (u32, f32)>) -> Vec<u8> {
    let (vertices, numbers): (Vec<u32>, Vec<f32>) = numbers.unzip();
    let mut frame = Vec::with_capacity(8 + 8 * vertices.len());
    frame.extend([VERTEX_NUMBERS, which as u8, 0, 0]);
    frame.extend((vertices.len() as u32).to_le_bytes());
    frame.extend(vertices.iter().flat_map(|vertex| vertex.to_le_bytes()));
    frame.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    frame
}
