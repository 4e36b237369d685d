//! Closed fans of faces around a vertex: while a fan is a height field, its faces meet only in
//! their common corner.

use nalgebra::{Point3, Vector3};

use super::ring::Ring;
use super::scratch_map::ScratchMap;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId, triangle};
use touchup_geometry::numeric::direction;

/// Smooth fans around the corners of a moving region.
///
/// The faces of a closed fan that goes around its vertex once, with all normals on one side of a
/// plane, have projections on that plane that lie beside each other.
#[derive(Clone, Debug, Default)]
pub(super) struct Fans {
    list: Vec<CornerFan>,
    /// ring numbers of the moving faces of the fans, fan after fan
    moving: Vec<u32>,
    /// numbers of the corners of the moving faces
    corners: ScratchMap,
    /// whether the fan around each corner is smooth
    are_smooth: Vec<bool>,
    /// a fan: neighbours of its vertex at the start and at the end of each face, relative to it, m
    spokes: Vec<[Spoke; 2]>,
    normals: Vec<Vector3<f64>>,
}

type Spoke = (VertexId, Vector3<f64>);

#[derive(Clone, Copy, Debug)]
struct CornerFan {
    corner: VertexId,
    /// mean normal, unit
    mean: Vector3<f64>,
    /// end of its faces in [`Fans::moving`]
    end: u32,
}

impl Fans {
    /// Makes room for the corners of `faces` moving faces.
    pub(crate) fn reserve(&mut self, faces: usize) {
        self.list.reserve(faces);
        self.moving.reserve(3 * faces);
        self.corners.reserve(2 * faces);
        self.are_smooth.reserve(faces);
    }

    /// Finds the fans whose normals are within `smallest_cosine` of their mean.
    ///
    /// - `normal`: unit normal of a ring face by its number.
    pub(crate) fn find(
        &mut self,
        mesh: &TriMesh,
        ring: &Ring,
        smallest_cosine: f64,
        normal: impl Fn(u32) -> Vector3<f64>,
    ) {
        self.list.clear();
        self.moving.clear();
        self.corners.clear();
        self.are_smooth.clear();
        for corner in ring.moving().iter().flat_map(|&face| mesh.corners(face)) {
            let [number] = self.corners.number([corner.0]);
            if (number as usize) < self.are_smooth.len() {
                continue;
            }
            let mean = self.smooth_mean(mesh, ring, corner, smallest_cosine, &normal);
            self.are_smooth.push(mean.is_some());
            if let Some(mean) = mean {
                let numbers = mesh
                    .star(corner)
                    .iter()
                    .filter_map(|&face| ring.number_of(face));
                self.moving
                    .extend(numbers.filter(|&number| (number as usize) < ring.moving));
                self.list.push(CornerFan {
                    corner,
                    mean,
                    end: self.moving.len() as u32,
                });
            }
        }
    }

    /// Whether the faces around this corner of a moving face need no test by pairs.
    #[inline]
    pub(crate) fn is_smooth(&self, corner: VertexId) -> bool {
        self.corners
            .of(corner.0)
            .is_some_and(|number| self.are_smooth[number as usize])
    }

    /// Whether no two faces of a fan have begun to meet.
    ///
    /// - `normal`: unit normal of a moving face after the update, by its number; a fan is smooth
    ///   within `smallest_cosine` of the mean.
    /// - `gap`, `before`: as in [`super::collision::Pairs::are_clear`].
    pub(crate) fn are_clear(
        &self,
        mesh: &TriMesh,
        smallest_cosine: f64,
        normal: impl Fn(u32) -> Vector3<f64>,
        gap: f64,
        before: impl Fn(VertexId) -> Point3<f64>,
    ) -> bool {
        let mut start = 0;
        self.list.iter().all(|fan| {
            let faces = &self.moving[start..fan.end as usize];
            start = fan.end as usize;
            let stays_smooth = faces
                .iter()
                .all(|&face| normal(face).dot(&fan.mean) > smallest_cosine);
            stays_smooth || is_fan_clear(mesh, fan.corner, gap, &before)
        })
    }

    /// Mean normal of the faces around a vertex, if they are a closed fan that goes around once,
    /// all within the cosine of it.
    fn smooth_mean(
        &mut self,
        mesh: &TriMesh,
        ring: &Ring,
        corner: VertexId,
        smallest_cosine: f64,
        normal: &impl Fn(u32) -> Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let Self {
            spokes, normals, ..
        } = self;
        let (star, centre) = (mesh.star(corner), mesh.position(corner));
        normals.clear();
        for &face in star {
            normals.push(match ring.number_of(face) {
                Some(number) => normal(number),
                None => direction(&mesh.double_area_normal(face))?,
            });
        }
        let mean = direction(&normals.iter().sum())?;
        if normals
            .iter()
            .any(|normal| normal.dot(&mean) <= smallest_cosine)
        {
            return None;
        }
        spokes.clear();
        for &face in star {
            let [a, b, c] = mesh.corners(face);
            let [start, end] = if a == corner {
                [b, c]
            } else if b == corner {
                [c, a]
            } else {
                [a, b]
            };
            spokes.push([start, end].map(|end| (end, mesh.position(end) - centre)));
        }
        goes_around_once(spokes, &mean).then_some(mean)
    }
}

/// Whether faces between spokes follow each other all around, once as seen along `mean`; all of
/// them are on its side.
fn goes_around_once(spokes: &[[Spoke; 2]], mean: &Vector3<f64>) -> bool {
    let Some([(first, from), (second, to)]) = spokes.first() else {
        return false;
    };
    let (mut at, mut steps) = (*second, 1);
    while at != *first {
        let mut next = spokes.iter().filter(|[(start, _), _]| *start == at);
        let (Some([_, (end, _)]), None) = (next.next(), next.next()) else {
            return false;
        };
        (at, steps) = (*end, steps + 1);
        if steps > spokes.len() {
            return false;
        }
    }
    // a ray through the first face meets no other
    let ray = from + to;
    let (left, right) = (mean.cross(&ray), ray.cross(mean));
    let others = spokes.iter().skip(1);
    steps == spokes.len()
        && others
            .clone()
            .all(|[(_, start), (_, end)]| !(right.dot(start) >= 0.0 && left.dot(end) >= 0.0))
}

/// Whether no two faces around a vertex have begun to meet, except faces that share an edge.
fn is_fan_clear(
    mesh: &TriMesh,
    corner: VertexId,
    gap: f64,
    before: impl Fn(VertexId) -> Point3<f64>,
) -> bool {
    let star = mesh.star(corner);
    let pairs = star
        .iter()
        .enumerate()
        .flat_map(|(at, &face)| star[..at].iter().map(move |&other| [face, other]));
    pairs.into_iter().all(|faces| {
        let [a, b] = faces.map(|face: FaceId| mesh.corners(face));
        if a.iter().filter(|corner| b.contains(corner)).count() > 1 {
            return true;
        }
        let at = |corners: &[VertexId; 3]| {
            corners
                .iter()
                .position(|&other| other == corner)
                .unwrap_or(0) as u8
        };
        let common = [at(&a), at(&b)];
        let meet = |[t, u]: [[Point3<f64>; 3]; 2]| triangle::meet(&t, &u, Some(common), gap);
        !meet([a, b].map(|corners| corners.map(|vertex| mesh.position(vertex))))
            || meet([a, b].map(|corners| corners.map(&before)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertex 0 with `around` others around it, over `turns` turns, each by `height` (of its turn)
    /// above it; closed.
    fn fan(around: u32, turns: f64, height: impl Fn(f64) -> f64) -> TriMesh {
        let rim = |k: u32| {
            let turn = turns * f64::from(k) / f64::from(around);
            Point3::new(
                (std::f64::consts::TAU * turn).cos(),
                (std::f64::consts::TAU * turn).sin(),
                height(turn),
            )
        };
        let positions = std::iter::once(Point3::origin())
            .chain((0..around).map(rim))
            .collect();
        TriMesh::new(
            positions,
            (0..around)
                .map(|k| [0, 1 + k, 1 + (k + 1) % around])
                .collect(),
        )
        .unwrap()
    }

    /// Fans around the corners of the faces at vertex 0.
    fn fans_of(mesh: &TriMesh) -> Fans {
        let mut ring = Ring::default();
        ring.gather(mesh, &[VertexId(0)]);
        let mut fans = Fans::default();
        fans.find(mesh, &ring, 0.35, |number| {
            mesh.normal(ring.faces[number as usize])
        });
        fans
    }

    #[test]
    fn a_fan_is_smooth_that_is_closed_and_goes_around_once() {
        assert!(fans_of(&fan(6, 1.0, |_| 0.5)).is_smooth(VertexId(0)));
        assert!(fans_of(&fan(3, 1.0, |turn| 0.4 * turn)).is_smooth(VertexId(0)));
        assert!(
            !fans_of(&fan(6, 1.0, |_| 3.0)).is_smooth(VertexId(0)),
            "its normals are 76 degrees from their mean"
        );
        assert!(
            !fans_of(&fan(12, 2.0, |turn| 0.3 * (1.0 - turn).abs())).is_smooth(VertexId(0)),
            "goes around twice"
        );
        let open = TriMesh::new(
            fan(6, 1.0, |_| 0.0).positions().to_vec(),
            vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]],
        )
        .unwrap();
        assert!(!fans_of(&open).is_smooth(VertexId(0)));
        assert!(
            !fans_of(&fan(6, 1.0, |_| 0.0)).is_smooth(VertexId(1)),
            "the rim has two faces"
        );
    }

    #[test]
    fn faces_of_a_smooth_fan_meet_in_their_corner_alone() {
        // a small generator of its own
        let mut state = 1u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let (mut smooth, mut met) = (0, 0);
        for _ in 0..4000 {
            let around = 4 + (5.0 * next()) as u32;
            let mut mesh = fan(around, 1.0, |_| 0.0);
            for vertex in 1..=around {
                let here = mesh.position(VertexId(vertex));
                let step = Vector3::new(next() - 0.5, next() - 0.5, 2.0 * next() - 1.0) * 2.0;
                mesh.set_position(VertexId(vertex), here + step);
            }
            // no faces met before the motion
            let is_clear = is_fan_clear(&mesh, VertexId(0), 0.0, |vertex| {
                fan(around, 1.0, |_| 0.0).position(vertex)
            });
            let is_smooth = fans_of(&mesh).is_smooth(VertexId(0));
            assert!(!is_smooth || is_clear, "{:?}", mesh.positions());
            smooth += usize::from(is_smooth);
            met += usize::from(!is_clear);
        }
        assert!(
            smooth > 400 && met > 400,
            "{smooth} smooth, {met} that meet themselves"
        );
    }

    #[test]
    fn a_fan_that_folds_over_is_looked_at() {
        let flat = fan(6, 1.0, |_| 0.1);
        let fans = fans_of(&flat);
        let mut ring = Ring::default();
        ring.gather(&flat, &[VertexId(0)]);
        let clear = |mesh: &TriMesh| {
            fans.are_clear(
                mesh,
                0.25,
                |n| mesh.normal(ring.faces[n as usize]),
                0.0,
                |v| flat.position(v),
            )
        };
        let mut mesh = flat.clone();
        assert!(clear(&mesh));
        // a spoke goes over its neighbour and through the face behind that
        mesh.set_position(VertexId(1), Point3::new(-0.4, 0.9, 0.05));
        assert!(!clear(&mesh));
        // an upright spoke ends the height field, and meets nothing
        mesh.set_position(VertexId(1), Point3::new(0.3, 0.0, 2.0));
        assert!(clear(&mesh));
    }
}
