//! The mesh to look at: in tiles, of which only those that changed are sent again.

use nalgebra::{Point3, Vector3};

use super::convert::{header, point};
use super::replica::Replica;
use crate::mesh::IdSet;
use crate::patch::Support;
use crate::ros::messages::{ColorRGBA, Marker, Vector3 as Vector3Msg};

/// Faces of a tile, by number: 1500 points are 60 kB with their colours, below the 64 kB of a datagram.
pub const FACES_OF_A_TILE: u32 = 500;
/// Namespace of the markers.
const NAMESPACE: &str = "mesh";
/// Light comes from above, a little from the side.
const LIGHT: Vector3<f64> = Vector3::new(0.3, 0.2, 0.933);
/// Share of the light that is everywhere.
const AMBIENT: f64 = 0.45;
/// A mismatch of so much has the full colour, m.
const FULL_MISMATCH: f64 = 0.5e-3;

/// What colours the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourBy {
    /// what was touched
    Touched,
    /// how far the surface was from where the mesh had it when it was touched last
    Mismatch,
}

/// Which tiles are to be sent.
#[derive(Debug, Default)]
pub struct Tiles {
    dirty: IdSet,
    /// for each tile, whether something is drawn
    is_drawn: Vec<bool>,
    /// for each face, the last signed distance at which it was touched, m; NaN where it was not
    mismatch: Vec<f32>,
}

impl Tiles {
    /// All of them are to be sent.
    pub fn all_of(replica: &Replica) -> Self {
        let mut tiles = Self::default();
        tiles.renew(replica);
        tiles
    }

    /// Everything is to be sent again.
    pub fn renew(&mut self, replica: &Replica) {
        // the last comes first: what is taken out is what was put in last
        (0..replica.slots()[1].div_ceil(FACES_OF_A_TILE).max(self.is_drawn.len() as u32))
            .rev()
            .for_each(|tile| self.dirty.insert(tile));
    }

    /// Another mesh: everything is to be sent, and nothing was touched.
    pub fn restart(&mut self, replica: &Replica) {
        self.mismatch.clear();
        self.renew(replica);
    }

    /// A tile is to be sent.
    pub fn note(&mut self, tile: u32) {
        self.dirty.insert(tile);
    }

    /// A face is another one now.
    pub fn forget_mismatch(&mut self, face: u32) {
        if let Some(mismatch) = self.mismatch.get_mut(face as usize) {
            *mismatch = f32::NAN;
        }
    }

    /// A face was touched this far from where the mesh had it, m.
    pub fn note_mismatch(&mut self, face: u32, distance: f64, replica: &Replica) {
        if face >= replica.slots()[1] {
            return;
        }
        if self.mismatch.len() <= face as usize {
            self.mismatch.resize(replica.slots()[1] as usize, f32::NAN);
        }
        self.mismatch[face as usize] = distance as f32;
        self.dirty.insert(face / FACES_OF_A_TILE);
    }

    /// How many are to be sent.
    pub fn waiting(&self) -> usize {
        self.dirty.len()
    }

    /// Makes up to `most` of those that are to be sent.
    pub fn take(&mut self, most: usize, replica: &Replica, by: ColourBy, frame: &str, mut each: impl FnMut(Marker)) {
        let Self { dirty, is_drawn, mismatch } = self;
        dirty.take(most, |tile| {
            let at = tile as usize;
            if at >= is_drawn.len() {
                is_drawn.resize(at + 1, false);
            }
            let marker = drawn(tile, replica, by, mismatch, frame);
            let is_empty = marker.points.is_empty();
            if !is_empty || is_drawn[at] {
                is_drawn[at] = !is_empty;
                each(marker);
            }
        });
    }
}

fn drawn(tile: u32, replica: &Replica, by: ColourBy, mismatch: &[f32], frame: &str) -> Marker {
    let mut marker = Marker {
        header: header(replica.stamp_ns, frame),
        ns: NAMESPACE.to_owned(),
        id: tile as i32,
        r#type: Marker::TRIANGLE_LIST,
        action: Marker::ADD,
        scale: Vector3Msg { x: 1.0, y: 1.0, z: 1.0 },
        color: ColorRGBA { r: 0.7, g: 0.7, b: 0.7, a: 1.0 },
        ..Marker::default()
    };
    for face in tile * FACES_OF_A_TILE..(tile + 1) * FACES_OF_A_TILE {
        let Some(corners) = replica.face(face) else { continue };
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| replica.vertex(corner)) else { continue };
        let light = light(&[a.0, b.0, c.0]);
        for (position, support) in [a, b, c] {
            let colour = match by {
                ColourBy::Touched => of_support(support),
                ColourBy::Mismatch => of_mismatch(mismatch.get(face as usize).copied().unwrap_or(f32::NAN)),
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

/// Viewers draw coloured points as they are, without light: it is in the colour.
fn light([a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
    AMBIENT + (1.0 - AMBIENT) * normal.dot(&LIGHT).abs().min(1.0)
}

fn of_support(support: Support) -> [f64; 3] {
    match support {
        Support::Scan => [0.72, 0.74, 0.78],
        Support::Touched => [0.25, 0.75, 0.35],
        Support::Guessed => [0.95, 0.80, 0.35],
        Support::Unreachable => [0.85, 0.45, 0.35],
    }
}

/// Red where the surface is outside of the mesh, blue where it is inside, white where both agree.
fn of_mismatch(distance: f32) -> [f64; 3] {
    if distance.is_nan() {
        return of_support(Support::Scan);
    }
    let share = (f64::from(distance) / FULL_MISMATCH).clamp(-1.0, 1.0);
    let faded = 1.0 - share.abs();
    if share > 0.0 { [1.0, faded, faded] } else { [faded, faded, 1.0] }
}
