//! One vertex for each position: files such as STL repeat a vertex in every face that uses it.

use nalgebra::Point3;

use crate::numeric::median;

/// Marks a free place in the table; no vertex has this number.
const FREE: u32 = u32::MAX;

/// Width of a cell of equal positions, relative to the spread of the mesh (0.1 nm on 100 mm).
///
/// CAD programs write the same corner once as 0 and once as 1e-17, and comparing bits leaves seams
/// in their parts: of 13 binary STL files of real parts five had such pairs, all closer than 1e-12
/// of the diagonal, and no other two vertices were closer than 1e-6 of it. Wider cells would begin
/// to close real slots.
const CELL: f64 = 1e-9;

/// Merges vertices in the same cell of a grid of width [`CELL`] into the first of them, which keeps
/// its position; −0 becomes 0.
///
/// Zero lies in the middle of a cell, as differences matter there. Two positions that rounding put
/// on two sides of a cell border stay apart: this takes 16 digits that agree up to the last and a
/// chance of 1e-6. In return the result depends on no order.
///
/// - `positions`: V × 3, any unit; shortened in place.
/// - `faces`: F × 3, every index below V; renamed in place.
/// - returns: number of removed vertices.
pub(super) fn weld(positions: &mut Vec<Point3<f64>>, faces: &mut [[u32; 3]]) -> usize {
    // a closed mesh has half as many vertices as faces; the table has two places for each
    let mut table = PositionTable::new(CELL * spread(positions), positions.len(), faces.len());
    // empty until the first vertex goes
    let mut renamed = Vec::new();
    let mut kept = 0;
    for start in (0..positions.len()).step_by(BLOCK) {
        let block = start..positions.len().min(start + BLOCK);
        table.make_room(&positions[..kept]);
        let probes = table.probes(&positions[block.clone()]);
        for (vertex, probe) in block.zip(&probes) {
            let first = table.find_or_add(&positions[vertex], probe, &positions[..kept]);
            if first as usize == kept {
                positions[kept] = positions[vertex].map(|x| x + 0.0);
                kept += 1;
            } else if renamed.is_empty() {
                renamed.extend(0..vertex as u32);
            }
            if kept <= vertex {
                renamed.push(first);
            }
        }
    }
    let welded = positions.len() - kept;
    if welded > 0 {
        positions.truncate(kept);
        positions.shrink_to_fit();
        for vertex in faces.as_flattened_mut() {
            *vertex = renamed[*vertex as usize];
        }
    }
    welded
}

/// Median distance (largest coordinate) from the median position, over a sample: single wild
/// vertices do not count.
fn spread(positions: &[Point3<f64>]) -> f64 {
    /// Smallest sample: every n-th vertex.
    const SAMPLE: usize = 1000;
    let sample = || positions.iter().step_by((positions.len() / SAMPLE).max(1));
    let middle = |mut values: Vec<f64>| median(&mut values).unwrap_or(0.0);
    let centre = [0, 1, 2].map(|axis| middle(sample().map(|p| p[axis]).collect()));
    middle(
        sample()
            .map(|p| (p - Point3::from(centre)).amax())
            .collect(),
    )
}

/// Vertices looked up together, with overlapping memory accesses.
const BLOCK: usize = 64;

/// Place of a position in a [`PositionTable`].
#[derive(Clone, Copy, Default)]
struct PositionProbe {
    /// hash of its cell
    hash: u64,
    /// entry of the first place at the start of the block
    entry: u32,
}

/// Open-addressing table from the cell of a position to a vertex; at most half full.
struct PositionTable {
    /// vertex (lower bits), part of the hash of its cell (the bits above)
    places: Vec<u32>,
    len: usize,
    /// bits for the vertex, with one number more than there are vertices: no entry is [`FREE`]
    vertex_bits: u32,
    /// cells per length; 0 if positions must agree in every bit
    cells: f64,
}

impl PositionTable {
    /// A table for at most `vertices` below 2³² − 1.
    fn new(cell: f64, vertices: usize, places: usize) -> Self {
        let cells = if cell.is_normal() { cell.recip() } else { 0.0 };
        let places = vec![FREE; places.max(2 * BLOCK).next_power_of_two()];
        Self {
            places,
            len: 0,
            vertex_bits: usize::BITS - vertices.leading_zeros(),
            cells,
        }
    }

    /// Makes room for one more block; `known`: the positions of the vertices in the table.
    fn make_room(&mut self, known: &[Point3<f64>]) {
        if 2 * (self.len + BLOCK) > self.places.len() {
            self.grow(known);
        }
    }

    /// First place of each position of a block.
    #[inline]
    fn probes(&self, block: &[Point3<f64>]) -> [PositionProbe; BLOCK] {
        let mut probes = [PositionProbe::default(); BLOCK];
        for (probe, position) in probes.iter_mut().zip(block) {
            probe.hash = hash(self.cell_of(position));
        }
        for probe in &mut probes[..block.len()] {
            probe.entry = self.places[self.first_place(probe.hash)];
        }
        probes
    }

    /// The vertex in the cell of this position, or a new one with the next number, `known.len()`.
    #[inline]
    fn find_or_add(
        &mut self,
        position: &Point3<f64>,
        probe: &PositionProbe,
        known: &[Point3<f64>],
    ) -> u32 {
        let (tag, mut place, mut entry) = (
            self.tag(probe.hash),
            self.first_place(probe.hash),
            probe.entry,
        );
        if entry == FREE {
            // may have an entry since
            entry = self.places[place];
        }
        while entry != FREE {
            let vertex = entry ^ tag;
            // below only if the tags agree
            if let Some(known) = known.get(vertex as usize)
                && self.cell_of(known) == self.cell_of(position)
            {
                return vertex;
            }
            place = (place + 1) & (self.places.len() - 1);
            entry = self.places[place];
        }
        self.places[place] = tag | known.len() as u32;
        self.len += 1;
        known.len() as u32
    }

    fn grow(&mut self, known: &[Point3<f64>]) {
        self.places = vec![FREE; 2 * self.places.len()];
        let mask = self.places.len() - 1;
        for (vertex, position) in known.iter().enumerate() {
            let hash = hash(self.cell_of(position));
            let mut place = self.first_place(hash);
            while self.places[place] != FREE {
                place = (place + 1) & mask;
            }
            self.places[place] = self.tag(hash) | vertex as u32;
        }
    }

    #[inline]
    fn first_place(&self, hash: u64) -> usize {
        hash as usize & (self.places.len() - 1)
    }

    #[inline]
    fn tag(&self, hash: u64) -> u32 {
        (hash >> 32 << self.vertex_bits) as u32
    }

    #[inline]
    fn cell_of(&self, position: &Point3<f64>) -> [u64; 3] {
        /// Adding and subtracting it rounds to integers while the sum keeps its exponent.
        const ROUND: f64 = 1.5 * (1u64 << 52) as f64;
        let cell = |x: f64| {
            let x = x + 0.0;
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
        fold(x ^ SPREAD, SPREAD).rotate_left(17)
            ^ fold(y ^ SPREAD.rotate_left(23), SPREAD)
            ^ z.rotate_left(41),
        SPREAD,
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    /// Number of these left after welding, beside a hundred more spread over 0 … 99 on each axis.
    fn left(positions: &[[f64; 3]]) -> usize {
        let mut all: Vec<_> = positions.iter().map(|&p| Point3::from(p)).collect();
        all.extend((0..100).map(|i| Point3::new(f64::from(i), f64::from(i), f64::from(i) + 0.5)));
        weld(&mut all, &mut []);
        all.len() - 100
    }

    #[test]
    fn rounding_is_welded_and_a_narrow_slot_is_not() {
        assert_eq!(
            left(&[
                [1.0, 0.0, 2.0],
                [1.0, 4e-16, 2.0],
                [1.0, -1e-17, 2.0],
                [1.0, -0.0, 2.0]
            ]),
            1
        );
        assert_eq!(left(&[[1.0, 3.3, 2.0], [1.0 + f64::EPSILON, 3.3, 2.0]]), 1);
        assert_eq!(left(&[[1.0, 0.0, 2.0], [1.0, 1e-6, 2.0]]), 2);
    }

    #[test]
    fn wild_vertices_do_not_widen_the_cells() {
        let wild = [
            [1e300, 0.0, 0.0],
            [f64::NAN, 1.0, 1.0],
            [f64::INFINITY, 2.0, 2.0],
        ];
        assert_eq!(left(&wild), 3);
        assert_eq!(
            left(&[wild[0], wild[1], [1.0, 0.0, 2.0], [1.0, 1e-6, 2.0]]),
            4
        );
    }

    #[test]
    fn far_from_the_origin_bits_decide() {
        // 1e15 m: next number 0.125 m further
        assert_eq!(
            left(&[[1e15, 0.0, 0.0], [1e15 + 0.125, 0.0, 0.0], [1e15, 0.0, 0.0]]),
            2
        );
    }

    #[test]
    fn the_first_occurrence_keeps_its_position_and_place() {
        let point = |x, y| Point3::new(x, y, 0.0);
        let mut positions = vec![
            point(3.0, 1e-17),
            point(9.0, 5.0),
            point(3.0, 0.0),
            point(0.0, 1.0),
            point(6.0, 2.0),
        ];
        let mut faces = [[2, 1, 0], [2, 3, 4]];
        assert_eq!(weld(&mut positions, &mut faces), 1);
        assert_eq!((positions[0].y, faces), (1e-17, [[0, 1, 0], [0, 2, 3]]));
    }

    proptest! {
        /// More vertices than a block and than the initial table, each position many times: against
        /// an ordered map.
        #[test]
        fn copies_of_lattice_points_get_the_number_of_the_first(
            points in prop::collection::vec((-4..4i8, -4..4i8, -4..4i8), 3..1500)
        ) {
            let mut first = BTreeMap::new();
            let wanted: Vec<u32> = points.iter().map(|p| {
                let next = first.len() as u32;
                *first.entry(p).or_insert(next)
            }).collect();
            let mut positions: Vec<_> = points.iter().map(|&(x, y, z)| Point3::new(x.into(), y.into(), z.into())).collect();
            let mut faces: Vec<_> = (0..points.len() as u32).map(|v| [v; 3]).collect();
            prop_assert_eq!(weld(&mut positions, &mut faces), points.len() - first.len());
            prop_assert!(faces.iter().map(|f| f[0]).eq(wanted.iter().copied()));
            for (&(x, y, z), &name) in points.iter().zip(&wanted) {
                prop_assert_eq!(positions[name as usize], Point3::new(x.into(), y.into(), z.into()));
            }
        }
    }
}
