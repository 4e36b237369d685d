//! The mesh for viewers: in tiles, of which only changed ones are resent.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};

use crate::ros::convert::{header, point};
use crate::ros::mesh_feed::{FACES_OF_A_TILE, MeshVersion};
use crate::ros::messages::{ColorRGBA, Marker, Vector3 as Vector3Msg};
use touchup_method::reconstruct::Support;

/// Time after which unchanged tiles are resent, so that viewers recover from outages shorter than
/// that.
const ONCE_MORE_AFTER: Duration = Duration::from_secs(10);
/// Namespace of the markers.
const NAMESPACE: &str = "mesh";
/// Direction of the light: from above, a little from the side.
const LIGHT: Vector3<f64> = Vector3::new(0.3, 0.2, 0.933);
/// Share of ambient light.
const AMBIENT: f64 = 0.45;
/// Mismatch with full colour, m.
const FULL_MISMATCH: f64 = 0.5e-3;

/// Colouring of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourBy {
    /// by the support of each vertex
    Touched,
    /// by the signed distance of the surface at the last touch
    Mismatch,
}

/// Waiting tiles, each once.
#[derive(Clone, Debug, Default)]
struct Turns {
    order: VecDeque<u32>,
    is_in: Vec<bool>,
}

impl Turns {
    fn push(&mut self, tile: u32) {
        let at = tile as usize;
        if self.is_in.len() <= at {
            self.is_in.resize(at + 1, false);
        }
        if !std::mem::replace(&mut self.is_in[at], true) {
            self.order.push_back(tile);
        }
    }

    fn pop(&mut self) -> Option<u32> {
        let tile = self.order.pop_front()?;
        self.is_in[tile as usize] = false;
        Some(tile)
    }
}

/// Tiles to send.
#[derive(Clone, Debug, Default)]
pub struct Tiles {
    /// changed tiles go first
    changed: Turns,
    /// then tiles resent for a new viewer or other colours
    again: Turns,
    /// for each tile, whether it has content
    is_drawn: Vec<bool>,
    /// for each tile, its number in the order of sending
    sent_as: Vec<u64>,
    sent: u64,
    /// tiles to resend unless a change comes first: time and number of sending
    once_more: VecDeque<(Instant, u32, u64)>,
    /// for each face, the signed distance at its last touch, m; NaN for an untouched one
    mismatch: Vec<f32>,
}

impl Tiles {
    /// Tiles with everything to send.
    pub fn all_of(mesh: &MeshVersion) -> Self {
        let mut tiles = Self::default();
        tiles.renew(mesh);
        tiles
    }

    /// Queues all tiles again.
    pub fn renew(&mut self, mesh: &MeshVersion) {
        (0..mesh.slots()[1]
            .div_ceil(FACES_OF_A_TILE)
            .max(self.is_drawn.len() as u32))
            .for_each(|tile| self.again.push(tile));
    }

    /// Queues tiles sent before the last `kept`: nobody keeps those for a new viewer.
    pub fn renew_older_than(&mut self, kept: u64) {
        let is_older = |sent_as: u64| sent_as > 0 && self.sent - sent_as >= kept;
        let older = (0..self.sent_as.len()).filter(|&tile| is_older(self.sent_as[tile]));
        older.for_each(|tile| self.again.push(tile as u32));
    }

    /// Queues tiles unchanged for a while once more, for viewers that missed them.
    pub fn renew_settled(&mut self, now: Instant) {
        while let Some(&(sent_at, tile, sent_as)) = self.once_more.front()
            && now.saturating_duration_since(sent_at) >= ONCE_MORE_AFTER
        {
            self.once_more.pop_front();
            if self.sent_as[tile as usize] == sent_as {
                self.again.push(tile);
            }
        }
    }

    /// Starts another mesh: all tiles are to be sent, and no mismatches are known.
    pub fn restart(&mut self, mesh: &MeshVersion) {
        self.mismatch.clear();
        self.sent_as.fill(0);
        self.renew(mesh);
    }

    /// Queues a changed tile.
    pub fn note(&mut self, tile: u32) {
        self.changed.push(tile);
    }

    /// Forgets the mismatch of a changed face.
    pub fn forget_mismatch(&mut self, face: u32) {
        if let Some(mismatch) = self.mismatch.get_mut(face as usize) {
            *mismatch = f32::NAN;
        }
    }

    /// Notes the signed distance of a touched face, m.
    pub fn note_mismatch(&mut self, face: u32, distance: f64, mesh: &MeshVersion) {
        if face >= mesh.slots()[1] {
            return;
        }
        if self.mismatch.len() <= face as usize {
            self.mismatch.resize(mesh.slots()[1] as usize, f32::NAN);
        }
        self.mismatch[face as usize] = distance as f32;
        self.note(face / FACES_OF_A_TILE);
    }

    /// Number of tiles to send.
    pub fn waiting(&self) -> usize {
        self.changed.order.len() + self.again.order.len()
    }

    /// Draws up to `most` of the waiting tiles.
    pub fn take(
        &mut self,
        most: usize,
        now: Instant,
        mesh: &MeshVersion,
        by: ColourBy,
        mut each: impl FnMut(Marker),
    ) {
        for _ in 0..most {
            let changed = self.changed.pop();
            let Some(tile) = changed.or_else(|| self.again.pop()) else {
                return;
            };
            let at = tile as usize;
            if at >= self.is_drawn.len() {
                self.is_drawn.resize(at + 1, false);
                self.sent_as.resize(at + 1, 0);
            }
            let marker = drawn(tile, mesh, by, &self.mismatch);
            let is_empty = marker.points.is_empty();
            let is_repeated = changed.is_none() && self.sent_as[at] > 0;
            if !is_empty || self.is_drawn[at] || is_repeated {
                self.is_drawn[at] = !is_empty;
                self.sent += 1;
                self.sent_as[at] = self.sent;
                if !is_repeated {
                    self.once_more.push_back((now, tile, self.sent));
                }
                each(marker);
            }
        }
    }
}

fn drawn(tile: u32, mesh: &MeshVersion, by: ColourBy, mismatch: &[f32]) -> Marker {
    let mut marker = Marker {
        header: header(mesh.stamp_ns, &mesh.frame),
        ns: NAMESPACE.to_owned(),
        id: tile as i32,
        r#type: Marker::TRIANGLE_LIST,
        action: Marker::ADD,
        scale: Vector3Msg {
            x: 1.0,
            y: 1.0,
            z: 1.0,
        },
        color: ColorRGBA {
            r: 0.7,
            g: 0.7,
            b: 0.7,
            a: 1.0,
        },
        ..Marker::default()
    };
    for face in tile * FACES_OF_A_TILE..(tile + 1) * FACES_OF_A_TILE {
        let Some(corners) = mesh.face(face) else {
            continue;
        };
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| mesh.vertex(corner)) else {
            continue;
        };
        let light = light(&[a.0, b.0, c.0]);
        for (position, support) in [a, b, c] {
            let colour = match by {
                ColourBy::Touched => of_support(support),
                ColourBy::Mismatch => {
                    of_mismatch(mismatch.get(face as usize).copied().unwrap_or(f32::NAN))
                }
            };
            let [r, g, b] = colour.map(|x| (x * light) as f32);
            marker.points.push(point(&position));
            marker.colors.push(ColorRGBA { r, g, b, a: 1.0 });
        }
    }
    if marker.points.is_empty() {
        marker.action = Marker::DELETE;
    }
    marker
}

/// Brightness of a face. Viewers draw coloured points without light, so the colour contains it.
fn light([a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a)
        .cross(&(c - a))
        .try_normalize(0.0)
        .unwrap_or_default();
    AMBIENT + (1.0 - AMBIENT) * normal.dot(&LIGHT).abs().min(1.0)
}

/// Colour of a support; dark enough for white labels in front of it.
fn of_support(support: Support) -> [f64; 3] {
    match support {
        Support::Scan => [0.60, 0.61, 0.63],
        Support::Touched => [0.0, 0.61, 0.32],
        Support::Guessed => [0.90, 0.78, 0.27],
        Support::Unreachable => [0.34, 0.13, 0.10],
    }
}

/// Colour of a mismatch: red for a surface outside of the mesh, blue inside, white for agreement.
fn of_mismatch(distance: f32) -> [f64; 3] {
    if distance.is_nan() {
        return of_support(Support::Scan);
    }
    let share = (f64::from(distance) / FULL_MISMATCH).clamp(-1.0, 1.0);
    let faded = 1.0 - share.abs();
    if share > 0.0 {
        [1.0, faded, faded]
    } else {
        [faded, faded, 1.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour_vision::least_difference;
    use crate::node::feature_messages;
    use std::sync::Arc;
    use touchup_geometry::mesh::{FaceTree, TriMesh};

    fn untouched(scan: TriMesh) -> MeshVersion {
        let tree = FaceTree::new(&scan);
        MeshVersion::of(Arc::new((scan, tree)), "object", "test", f32::NAN)
    }

    #[test]
    fn states_and_the_features_before_them_are_apart_without_red_and_green() {
        let states = [
            Support::Scan,
            Support::Touched,
            Support::Guessed,
            Support::Unreachable,
        ]
        .map(of_support);
        let features = feature_messages::COLOURS.map(|colour| colour.map(f64::from));
        let colours: Vec<[u8; 3]> = states
            .iter()
            .chain(&features)
            .map(|colour| colour.map(|x| (255.0 * x).round() as u8))
            .collect();
        assert!(least_difference(&colours) > 23.0);
    }

    /// A port keeps the end of the list of sent tiles.
    #[test]
    fn who_joins_late_is_sent_what_is_not_kept() {
        let corner = |i: u32| Point3::new(f64::from(i), f64::from(i % 2), 0.0);
        let strip = (0..4 * FACES_OF_A_TILE).map(|i| {
            if i % 2 == 0 {
                [i, i + 1, i + 2]
            } else {
                [i + 1, i, i + 2]
            }
        });
        let mesh = TriMesh::new(
            (0..4 * FACES_OF_A_TILE + 2).map(corner).collect(),
            strip.collect(),
        )
        .unwrap();
        let mesh = untouched(mesh);
        let mut tiles = Tiles::all_of(&mesh);
        let mut sent = Vec::new();
        let take = |tiles: &mut Tiles, sent: &mut Vec<u32>| {
            let how = ColourBy::Touched;
            tiles.take(usize::MAX, Instant::now(), &mesh, how, |tile| {
                sent.push(tile.id as u32)
            });
        };
        take(&mut tiles, &mut sent);
        for tile in [2, 2, 0] {
            tiles.note(tile);
            take(&mut tiles, &mut sent);
        }
        assert_eq!(sent.len(), 7);
        for kept in 1..=8 {
            let lost: Vec<u32> = (0..4)
                .filter(|tile| !sent.iter().rev().take(kept).any(|other| other == tile))
                .collect();
            let mut again = Vec::new();
            let mut joined = tiles.clone();
            joined.renew_older_than(kept as u64);
            take(&mut joined, &mut again);
            assert_eq!(again, lost, "the last {kept} are kept");
        }
        // changes meanwhile go first
        tiles.renew_older_than(1);
        [3, 1, 3].into_iter().for_each(|tile| tiles.note(tile));
        sent.clear();
        take(&mut tiles, &mut sent);
        assert_eq!(sent, [3, 1, 1, 2, 3]);
    }

    #[test]
    fn what_has_settled_is_sent_once_more_also_when_it_is_gone() {
        let corner = |i: u32| Point3::new(f64::from(i), f64::from(i % 2), 0.0);
        let strip = (0..3 * FACES_OF_A_TILE).map(|i| {
            if i % 2 == 0 {
                [i, i + 1, i + 2]
            } else {
                [i + 1, i, i + 2]
            }
        });
        let mesh = TriMesh::new(
            (0..3 * FACES_OF_A_TILE + 2).map(corner).collect(),
            strip.collect(),
        )
        .unwrap();
        let first = TriMesh::new(vec![corner(0), corner(1), corner(2)], vec![[0, 1, 2]]).unwrap();
        let [whole, none] = [mesh, first].map(untouched);
        let mut tiles = Tiles::all_of(&whole);
        let begun = Instant::now();
        let mut at = |seconds: u64, mesh: &MeshVersion, changed: &[u32]| {
            let now = begun + Duration::from_secs(seconds);
            changed.iter().for_each(|&tile| tiles.note(tile));
            tiles.renew_settled(now);
            let mut sent = Vec::new();
            let how = ColourBy::Touched;
            tiles.take(usize::MAX, now, mesh, how, |tile| {
                sent.push((tile.id, tile.action))
            });
            sent.sort_unstable();
            sent
        };
        let (add, delete) = (Marker::ADD, Marker::DELETE);
        assert_eq!(at(0, &whole, &[]), [(0, add), (1, add), (2, add)]);
        assert_eq!(at(5, &whole, &[1]), [(1, add)]);
        assert_eq!(at(9, &none, &[2]), [(2, delete)]);
        assert_eq!(at(10, &whole, &[]), [(0, add)]);
        assert_eq!(at(15, &whole, &[]), [(1, add)]);
        assert_eq!(at(19, &none, &[]), [(2, delete)]);
        assert_eq!(at(99, &whole, &[]), []);
    }
}
