//! Slots and pockets.

use nalgebra::{Point3, Vector3};

use crate::features::fit::Ends;

/// A void between two walls that face each other.
#[derive(Clone, Debug)]
pub(in crate::features) struct Slot {
    /// numbers of its walls
    pub walls: Vec<usize>,
    /// numbers of the segments that end it, `None` if open or without a named segment
    pub ends: [Option<usize>; 2],
    /// shape of its ends
    pub shape: Ends,
    /// middle of the opening, m, in O
    pub centre: Point3<f64>,
    /// unit vector out of the opening
    pub out: Vector3<f64>,
    /// unit vector along it
    pub direction: Vector3<f64>,
    /// m
    pub width: f64,
    /// m; at an open end to the ends of the walls
    pub length: f64,
    /// m
    pub depth: f64,
    /// `None`: neither a floor nor an opening on the other side
    pub through: Option<bool>,
    /// number of the plane of its floor
    pub floor: Option<usize>,
    /// number of the plane, or of the cylinder with the material inside, around the opening
    pub land: usize,
    /// whether planes close both ends, so that only a long one is a slot
    pub is_boxed: bool,
    /// whether both ends exist
    pub is_closed: bool,
    /// whether a wall aslant closes an end: a recess of another outline
    pub is_aslant: bool,
    /// area of its walls with evidence, m²
    pub area: f64,
}

impl Slot {
    /// Numbers of its walls, then of its ends.
    pub(in crate::features) fn segments(&self) -> impl Iterator<Item = usize> {
        let ends = self.ends.into_iter().flatten();
        self.walls.iter().copied().chain(ends)
    }

    /// Whether the middle of another void is between its walls, and both overlap over more than
    /// half of the depth of the shallower: their apparent depths may differ.
    pub(super) fn holds(&self, other: &Self) -> bool {
        let v = other.centre - self.centre;
        let middle = v - other.out * (other.depth / 2.0);
        let across = self.out.cross(&self.direction);
        let is_between = middle.dot(&across).abs() < self.width / 2.0
            && middle.dot(&self.direction).abs() < self.length / 2.0;
        let top = v.dot(&self.out);
        let bottom = top - other.depth * other.out.dot(&self.out);
        let overlap = top.max(bottom).min(0.0) - top.min(bottom).max(-self.depth);
        is_between && overlap > self.depth.min(other.depth) / 2.0
    }
}

/// For each slot the number of the one that it belongs to: an undercut opens in a wall of its slot, as
/// both sides of the room of a T-slot do. `None`: a slot by itself.
pub(in crate::features) fn undercut_groups(slots: &[Slot]) -> Vec<Option<usize>> {
    let host = |slot: &Slot| slots.iter().position(|one| one.walls.contains(&slot.land));
    let hosts: Vec<Option<usize>> = slots.iter().map(host).collect();
    let of_slot = |at: usize| hosts[at].or(hosts.contains(&Some(at)).then_some(at));
    (0..slots.len()).map(of_slot).collect()
}
