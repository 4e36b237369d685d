//! One vertex for each position: files such as STL repeat a vertex in every face that uses it.

use nalgebra::Point3;

/// Marks a free place in the table: no vertex has this number.
const FREE: u64 = u64::MAX;

/// Width of a cell in which positions count as the same one, relative to the spread of the mesh (0.1 nm on 100 mm).
///
/// CAD programs write the same corner once as 0 and once as 1e-17, so that comparing bits leaves seams in their parts:
/// of 13 binary STL files of real parts five had such pairs, all closer than 1e-12 of the diagonal, and no other two
/// vertices were closer than 1e-6 of it. Wider cells would begin to close slots that are really there.
const CELL: f64 = 1e-9;

/// Merges vertices in the same cell of a grid of width [`CELL`], in order of first occurrence, whose position stays;
/// −0 becomes 0.
///
/// Zero lies in the middle of a cell, which is where the difference matters. Two positions that rounding put on two
/// sides of a border between cells are not merged: it takes 16 digits that agree up to the last and a chance of 1e-6.
/// In return the result depends on no order.
///
/// - `positions`: V × 3, any unit; shortened in place.
/// - `faces`: F × 3, every index below V; renamed in place.
/// - returns: how many vertices went away.
pub(super) fn weld(positions: &mut Vec<Point3<f64>>, faces: &mut [[u32; 3]]) -> usize {
    // a closed mesh has half as many vertices as faces; the table has two places for each
    let mut table = PositionTable::new(CELL * spread(positions), faces.len());
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

/// Median distance (largest coordinate) from the median position, over a sample: single wild vertices do not count.
fn spread(positions: &[Point3<f64>]) -> f64 {
    /// Every n-th vertex, so that there are at least this many.
    const SAMPLE: usize = 1000;
    let sample = || positions.iter().step_by((positions.len() / SAMPLE).max(1));
    let centre = [0, 1, 2].map(|axis| median(sample().map(|p| p[axis]).collect()));
    median(sample().map(|p| (p - Point3::from(centre)).amax()).collect())
}

/// The middle one in rising order; 0 when there is none.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Open-addressing table from the cell of a position to a vertex; at most half full.
struct PositionTable {
    /// hash of the cell (upper 32 bits), vertex (lower 32 bits)
    places: Vec<u64>,
    len: usize,
    /// cells per length; 0 when positions must agree in every bit
    cells: f64,
}

impl PositionTable {
    fn new(cell: f64, places: usize) -> Self {
        let cells = if cell.is_normal() { cell.recip() } else { 0.0 };
        Self { places: vec![FREE; places.max(64).next_power_of_two()], len: 0, cells }
    }

    /// The vertex in the cell of this position, or the next number, `known.len()`, which is then taken.
    fn find_or_add(&mut self, position: &Point3<f64>, known: &[Point3<f64>]) -> u32 {
        if 2 * self.len >= self.places.len() {
            self.grow(known);
        }
        let cell = self.cell_of(position);
        let hash = hash(cell);
        let mask = self.places.len() - 1;
        let mut place = hash as usize & mask;
        while self.places[place] != FREE {
            let (tag, vertex) = (self.places[place] >> 32, self.places[place] as u32);
            if tag == hash >> 32 && self.cell_of(&known[vertex as usize]) == cell {
                return vertex;
            }
            place = (place + 1) & mask;
        }
        self.places[place] = hash >> 32 << 32 | known.len() as u64;
        self.len += 1;
        known.len() as u32
    }

    fn grow(&mut self, known: &[Point3<f64>]) {
        let mask = 2 * self.places.len() - 1;
        for entry in std::mem::replace(&mut self.places, vec![FREE; mask + 1]).into_iter().filter(|&e| e != FREE) {
            let mut place = hash(self.cell_of(&known[entry as u32 as usize])) as usize & mask;
            while self.places[place] != FREE {
                place = (place + 1) & mask;
            }
            self.places[place] = entry;
        }
    }

    #[inline]
    fn cell_of(&self, position: &Point3<f64>) -> [u64; 3] {
        /// Added and taken away it rounds to whole numbers, as long as the sum keeps its exponent.
        const ROUND: f64 = 1.5 * (1u64 << 52) as f64;
        let cell = |x: f64| {
            let scaled = x * self.cells;
            if scaled.abs() < (1u64 << 51) as f64 && self.cells > 0.0 {
                (scaled + ROUND).to_bits()
            } else {
                x.to_bits()
            }
        };
        [cell(position.x), cell(position.y), cell(position.z)]
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of these are left, a hundred more being spread over 0 … 99 on each axis.
    fn left(positions: &[[f64; 3]]) -> usize {
        let mut all: Vec<_> = positions.iter().map(|&p| Point3::from(p)).collect();
        all.extend((0..100).map(|i| Point3::new(f64::from(i), f64::from(i), f64::from(i) + 0.5)));
        weld(&mut all, &mut []);
        all.len() - 100
    }

    #[test]
    fn rounding_is_welded_and_a_narrow_slot_is_not() {
        assert_eq!(left(&[[1.0, 0.0, 2.0], [1.0, 4e-16, 2.0], [1.0, -1e-17, 2.0], [1.0, -0.0, 2.0]]), 1);
        assert_eq!(left(&[[1.0, 3.3, 2.0], [1.0 + f64::EPSILON, 3.3, 2.0]]), 1);
        assert_eq!(left(&[[1.0, 0.0, 2.0], [1.0, 1e-6, 2.0]]), 2);
    }

    #[test]
    fn wild_vertices_do_not_widen_the_cells() {
        let wild = [[1e300, 0.0, 0.0], [f64::NAN, 1.0, 1.0], [f64::INFINITY, 2.0, 2.0]];
        assert_eq!(left(&wild), 3);
        assert_eq!(left(&[wild[0], wild[1], [1.0, 0.0, 2.0], [1.0, 1e-6, 2.0]]), 4);
    }

    #[test]
    fn far_from_the_origin_bits_decide() {
        // 1e15 m: next number 0.125 m further
        assert_eq!(left(&[[1e15, 0.0, 0.0], [1e15 + 0.125, 0.0, 0.0], [1e15, 0.0, 0.0]]), 2);
    }

    #[test]
    fn the_first_occurrence_keeps_its_position_and_place() {
        let point = |x, y| Point3::new(x, y, 0.0);
        let mut positions = vec![point(3.0, 1e-17), point(9.0, 5.0), point(3.0, 0.0), point(0.0, 1.0), point(6.0, 2.0)];
        let mut faces = [[2, 1, 0], [2, 3, 4]];
        assert_eq!(weld(&mut positions, &mut faces), 1);
        assert_eq!((positions[0].y, faces), (1e-17, [[0, 1, 0], [0, 2, 3]]));
    }
}
