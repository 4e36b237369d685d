//! One vertex for each position: files such as STL repeat a vertex in every face that uses it.

use nalgebra::Point3;

/// Marks a free place in the table.
const FREE: u32 = u32::MAX;

/// Merges vertices whose coordinates are equal bit for bit, in order of first occurrence; −0 counts as 0 and becomes it.
///
/// No tolerance: exporters write a shared vertex with the same digits everywhere, while a tolerance would close thin
/// gaps and slots that are really there, and would make the result depend on the order of the vertices.
///
/// - `positions`: V × 3, any unit; shortened in place.
/// - `faces`: F × 3, every index below V; renamed in place.
/// - returns: how many vertices went away.
pub(super) fn weld(positions: &mut Vec<Point3<f64>>, faces: &mut [[u32; 3]]) -> usize {
    let mut table = PositionTable::default();
    let mut renamed = Vec::with_capacity(positions.len());
    let mut kept = 0;
    for vertex in 0..positions.len() {
        let position = positions[vertex].map(|x| x + 0.0);
        let first = table.find_or_add(&position, &positions[..kept]);
        if first as usize == kept {
            positions[kept] = position;
            kept += 1;
        }
        renamed.push(first);
    }
    let welded = positions.len() - kept;
    if welded > 0 {
        positions.truncate(kept);
        for vertex in faces.as_flattened_mut() {
            *vertex = renamed[*vertex as usize];
        }
    }
    welded
}

/// Open-addressing table from position to vertex; at most half full.
#[derive(Default)]
struct PositionTable {
    places: Vec<u32>,
    len: usize,
}

impl PositionTable {
    /// The vertex at this position, or the next number, `known.len()`, which is then taken.
    fn find_or_add(&mut self, position: &Point3<f64>, known: &[Point3<f64>]) -> u32 {
        if 2 * self.len >= self.places.len() {
            self.grow(known);
        }
        let place = self.place_of(position, known);
        if self.places[place] == FREE {
            self.places[place] = known.len() as u32;
            self.len += 1;
        }
        self.places[place]
    }

    /// Where this position stands or would be put.
    fn place_of(&self, position: &Point3<f64>, known: &[Point3<f64>]) -> usize {
        let wanted = bits(position);
        let mask = self.places.len() - 1;
        let mut place = hash(wanted) as usize & mask;
        while self.places[place] != FREE && bits(&known[self.places[place] as usize]) != wanted {
            place = (place + 1) & mask;
        }
        place
    }

    fn grow(&mut self, known: &[Point3<f64>]) {
        self.places = vec![FREE; (4 * self.len).max(64).next_power_of_two()];
        for (vertex, position) in known.iter().enumerate() {
            let place = self.place_of(position, known);
            self.places[place] = vertex as u32;
        }
    }
}

fn bits(position: &Point3<f64>) -> [u64; 3] {
    [position.x.to_bits(), position.y.to_bits(), position.z.to_bits()]
}

/// Mixes all bits into the low ones: coordinates from `f32` have only zeros there.
fn hash([x, y, z]: [u64; 3]) -> u64 {
    /// The fractional part of the golden ratio, odd: spreads equally spaced keys evenly.
    const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;
    let fold = |a: u64, b: u64| {
        let product = u128::from(a) * u128::from(b);
        product as u64 ^ (product >> 64) as u64
    };
    fold(
        fold(x ^ SPREAD, SPREAD).rotate_left(17) ^ fold(y ^ SPREAD.rotate_left(23), SPREAD) ^ z.rotate_left(41),
        SPREAD,
    )
}
