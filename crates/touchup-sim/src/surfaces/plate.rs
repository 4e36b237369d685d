//! A machined plate made by code, with an exact signed distance and its features as plain numbers.
//!
//! The plate lies on z = 0 with one corner in the origin. Every wall is parallel to z, so the
//! boundary consists of three kinds of patch: rectangles with holes, lids, and walls above the
//! outline of a [`PlateStadium`]. The distance is the smallest over all patches, each in closed
//! form; the sign comes from the cross-section at the point's height.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::surface::{Bounds, Surface, SurfacePoint};
use touchup_features::features::{FeatureKind, InspectedQuantity};

/// All points within `radius` of a segment; a disc when the segment has no length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateStadium {
    /// centre of one rounded end, m
    pub from: Point2<f64>,
    /// centre of the other, m
    pub to: Point2<f64>,
    /// m
    pub radius: f64,
}

impl PlateStadium {
    const fn disc(x: f64, y: f64, radius: f64) -> Self {
        Self {
            from: Point2::new(x, y),
            to: Point2::new(x, y),
            radius,
        }
    }

    /// Middle of the segment, m.
    pub fn centre(&self) -> Point2<f64> {
        nalgebra::center(&self.from, &self.to)
    }

    /// The point of the segment closest to `q`.
    fn spine(&self, q: &Point2<f64>) -> Point2<f64> {
        let along = self.to - self.from;
        let t = (q - self.from).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        self.from + along * t.clamp(0.0, 1.0)
    }

    fn contains(&self, q: &Point2<f64>) -> bool {
        (q - self.spine(q)).norm() < self.radius
    }

    /// The outline's point closest to `q`, and the direction out of the stadium there.
    fn outline(&self, q: &Point2<f64>) -> (Point2<f64>, Vector2<f64>) {
        let spine = self.spine(q);
        let across = self.to - self.from;
        let square = Vector2::new(-across.y, across.x)
            .try_normalize(0.0)
            .unwrap_or_else(Vector2::x);
        let out = (q - spine).try_normalize(0.0).unwrap_or(square);
        (spine + out * self.radius, out)
    }
}

/// A hole, slot or boss: raised or cut along z over the outline of a stadium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extrusion {
    pub(crate) outline: PlateStadium,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Kind of a [`TruthFeature`], with its sizes in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TruthShape {
    /// round hole
    Hole {
        /// m
        diameter: f64,
        /// m, from the opening
        depth: f64,
        /// whether it goes through the plate
        through: bool,
    },
    /// slot with rounded ends
    Slot {
        /// m
        width: f64,
        /// m, over the rounded ends
        length: f64,
        /// m
        depth: f64,
        /// unit vector along the slot
        direction: Vector3<f64>,
    },
    /// round boss
    Boss {
        /// m
        diameter: f64,
        /// m
        height: f64,
    },
    /// straight step
    Step {
        /// m
        height: f64,
        /// m
        length: f64,
        /// unit vector along the edge
        direction: Vector3<f64>,
    },
}

/// One feature of the plate, as on a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthFeature {
    /// user's name of the feature
    pub name: &'static str,
    /// centre of the opening, of the boss' foot, or middle of the upper edge; m, in O
    pub centre: Point3<f64>,
    /// opening direction, unit vector in O
    pub axis: Vector3<f64>,
    /// kind and sizes
    pub shape: TruthShape,
}

impl TruthFeature {
    /// The kind that it is found as.
    pub fn kind(&self) -> FeatureKind {
        match self.shape {
            TruthShape::Hole { .. } => FeatureKind::Hole,
            TruthShape::Slot { .. } => FeatureKind::Slot,
            TruthShape::Boss { .. } => FeatureKind::Boss,
            TruthShape::Step { .. } => FeatureKind::Edge,
        }
    }

    /// Sizes on a drawing, m: of a through hole without its depth, of a step none.
    pub fn sizes(&self) -> Vec<(InspectedQuantity, f64)> {
        use InspectedQuantity::{Depth, Diameter, Length, Width};
        match self.shape {
            TruthShape::Hole {
                diameter,
                through: true,
                ..
            } => vec![(Diameter, diameter)],
            TruthShape::Hole {
                diameter, depth, ..
            } => vec![(Diameter, diameter), (Depth, depth)],
            TruthShape::Slot {
                width,
                length,
                depth,
                ..
            } => vec![(Width, width), (Length, length), (Depth, depth)],
            TruthShape::Boss { diameter, height } => vec![(Diameter, diameter), (Depth, height)],
            TruthShape::Step { .. } => Vec::new(),
        }
    }

    /// Direction of the axis, of a step along its edge.
    pub fn direction(&self) -> Vector3<f64> {
        match self.shape {
            TruthShape::Step { direction, .. } => direction,
            _ => self.axis,
        }
    }
}

/// The plate: 80 × 50 × 12 mm with a through-hole, a blind hole, a slot, a step and a boss.
#[derive(Clone, Debug, PartialEq)]
pub struct Plate {
    /// length, width, height below the step; m
    pub(crate) size: Vector3<f64>,
    /// x of the step's riser, m
    pub(crate) step_x: f64,
    /// height beyond the step, m
    pub(crate) step_z: f64,
    pub(crate) through: Extrusion,
    pub(crate) blind: Extrusion,
    pub(crate) slot: Extrusion,
    pub(crate) boss: Extrusion,
    patches: Vec<BoundaryPatch>,
}

impl Default for Plate {
    fn default() -> Self {
        let high = 0.012;
        let slot = PlateStadium {
            from: Point2::new(0.018, 0.014),
            to: Point2::new(0.032, 0.014),
            radius: 0.003,
        };
        let mut plate = Self {
            size: Vector3::new(0.080, 0.050, high),
            step_x: 0.060,
            step_z: 0.009,
            through: Extrusion {
                outline: PlateStadium::disc(0.016, 0.036, 0.004),
                low: 0.0,
                high,
            },
            blind: Extrusion {
                outline: PlateStadium::disc(0.032, 0.034, 0.003),
                low: 0.004,
                high,
            },
            slot: Extrusion {
                outline: slot,
                low: 0.007,
                high,
            },
            boss: Extrusion {
                outline: PlateStadium::disc(0.047, 0.025, 0.005),
                low: high,
                high: 0.016,
            },
            patches: Vec::new(),
        };
        plate.patches = plate.boundary();
        plate
    }
}

impl Plate {
    /// The features with their true sizes.
    pub fn features(&self) -> [TruthFeature; 5] {
        let axis = Vector3::z();
        let at = |e: &Extrusion, z| Point3::new(e.outline.centre().x, e.outline.centre().y, z);
        let hole = |name, e: &Extrusion, through| TruthFeature {
            name,
            centre: at(e, e.high),
            axis,
            shape: TruthShape::Hole {
                diameter: 2.0 * e.outline.radius,
                depth: e.high - e.low,
                through,
            },
        };
        let (slot, boss) = (&self.slot, &self.boss);
        let along = slot.outline.to - slot.outline.from;
        let slot_shape = TruthShape::Slot {
            width: 2.0 * slot.outline.radius,
            length: along.norm() + 2.0 * slot.outline.radius,
            depth: slot.high - slot.low,
            direction: Vector3::new(along.x, along.y, 0.0).normalize(),
        };
        let boss_shape = TruthShape::Boss {
            diameter: 2.0 * boss.outline.radius,
            height: boss.high - boss.low,
        };
        let step_shape = TruthShape::Step {
            height: self.size.z - self.step_z,
            length: self.size.y,
            direction: Vector3::y(),
        };
        let middle = Point3::new(self.step_x, self.size.y / 2.0, self.size.z);
        [
            hole("through-hole", &self.through, true),
            hole("blind hole", &self.blind, false),
            TruthFeature {
                name: "slot",
                centre: at(slot, slot.high),
                axis,
                shape: slot_shape,
            },
            TruthFeature {
                name: "boss",
                centre: at(boss, boss.low),
                axis,
                shape: boss_shape,
            },
            TruthFeature {
                name: "step",
                centre: middle,
                axis,
                shape: step_shape,
            },
        ]
    }

    /// Whether `p` is inside the material.
    fn is_inside(&self, p: &Point3<f64>) -> bool {
        let within = |e: &Extrusion| e.outline.contains(&p.xy()) && p.z < e.high;
        let top = if p.x < self.step_x {
            self.size.z
        } else {
            self.step_z
        };
        let over = |x: f64, size: f64| x > 0.0 && x < size;
        let in_block = over(p.x, self.size.x) && over(p.y, self.size.y) && over(p.z, top);
        let cut = within(&self.through)
            || [&self.blind, &self.slot]
                .into_iter()
                .any(|e| within(e) && p.z > e.low);
        in_block && !cut || within(&self.boss) && p.z >= self.boss.low
    }

    fn boundary(&self) -> Vec<BoundaryPatch> {
        let (size, x, z) = (self.size, self.step_x, self.step_z);
        let [through, blind, slot, boss] =
            [&self.through, &self.blind, &self.slot, &self.boss].map(|e| e.outline);
        let flat = |axis: usize,
                    side: f64,
                    level: f64,
                    low: [f64; 2],
                    high: [f64; 2],
                    holes: Vec<PlateStadium>| {
            BoundaryPatch::Flat {
                axis,
                side,
                level,
                low: low.into(),
                high: high.into(),
                holes,
            }
        };
        let wall = |e: &Extrusion, side: f64| BoundaryPatch::Wall {
            outline: e.outline,
            low: e.low,
            high: e.high,
            side,
        };
        let lid = |outline: PlateStadium, level: f64| BoundaryPatch::Lid { outline, level };
        vec![
            flat(2, -1.0, 0.0, [0.0, 0.0], [size.x, size.y], vec![through]),
            flat(
                2,
                1.0,
                size.z,
                [0.0, 0.0],
                [x, size.y],
                vec![through, blind, slot, boss],
            ),
            flat(2, 1.0, z, [x, 0.0], [size.x, size.y], vec![]),
            flat(0, 1.0, x, [0.0, z], [size.y, size.z], vec![]),
            flat(0, -1.0, 0.0, [0.0, 0.0], [size.y, size.z], vec![]),
            flat(0, 1.0, size.x, [0.0, 0.0], [size.y, z], vec![]),
            // the two long sides have the step's outline: two rectangles each
            flat(1, -1.0, 0.0, [0.0, 0.0], [z, size.x], vec![]),
            flat(1, -1.0, 0.0, [0.0, 0.0], [size.z, x], vec![]),
            flat(1, 1.0, size.y, [0.0, 0.0], [z, size.x], vec![]),
            flat(1, 1.0, size.y, [0.0, 0.0], [size.z, x], vec![]),
            wall(&self.through, -1.0),
            wall(&self.blind, -1.0),
            wall(&self.slot, -1.0),
            wall(&self.boss, 1.0),
            lid(blind, self.blind.low),
            lid(slot, self.slot.low),
            lid(boss, self.boss.high),
        ]
    }
}

/// One smooth piece of the boundary.
#[derive(Clone, Debug, PartialEq)]
enum BoundaryPatch {
    /// A rectangle in the plane coordinate `axis` = `level`, less some discs and stadiums; the two
    /// coordinates in it follow `axis` cyclically. `side`: +1 for a normal along the axis.
    Flat {
        axis: usize,
        side: f64,
        level: f64,
        low: Point2<f64>,
        high: Point2<f64>,
        holes: Vec<PlateStadium>,
    },
    /// A stadium at a height, its normal along +z.
    Lid { outline: PlateStadium, level: f64 },
    /// The prism above an outline; `side`: +1 for a normal away from the stadium.
    Wall {
        outline: PlateStadium,
        low: f64,
        high: f64,
        side: f64,
    },
}

impl BoundaryPatch {
    /// The patch's point closest to `p`.
    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        match self {
            Self::Flat {
                axis,
                side,
                level,
                low,
                high,
                holes,
            } => {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let inside = Point2::new(p[u], p[v]).sup(low).inf(high);
                // the cut-outs stay clear of the rim and of each other: at most one holds the point
                let free = holes
                    .iter()
                    .find(|hole| hole.contains(&inside))
                    .map_or(inside, |h| h.outline(&inside).0);
                let (mut point, mut normal) = (Point3::origin(), Vector3::zeros());
                (point[*axis], point[u], point[v]) = (*level, free.x, free.y);
                normal[*axis] = *side;
                SurfacePoint { point, normal }
            }
            Self::Lid { outline, level } => {
                let q = p.xy();
                let q = if outline.contains(&q) {
                    q
                } else {
                    outline.outline(&q).0
                };
                SurfacePoint {
                    point: Point3::new(q.x, q.y, *level),
                    normal: Vector3::z(),
                }
            }
            Self::Wall {
                outline,
                low,
                high,
                side,
            } => {
                let (q, out) = outline.outline(&p.xy());
                let point = Point3::new(q.x, q.y, p.z.clamp(*low, *high));
                SurfacePoint {
                    point,
                    normal: Vector3::new(out.x, out.y, 0.0) * *side,
                }
            }
        }
    }
}

impl Surface for Plate {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        let distance = (p - self.closest(p).point).norm();
        if self.is_inside(p) {
            -distance
        } else {
            distance
        }
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        self.patches
            .iter()
            .map(|patch| patch.closest(p))
            .min_by(|a, b| {
                (p - a.point)
                    .norm_squared()
                    .total_cmp(&(p - b.point).norm_squared())
            })
            .expect("a plate has patches")
    }

    fn bounds(&self) -> Bounds {
        let top = Point3::new(self.size.x, self.size.y, self.boss.high);
        Bounds {
            min: Point3::origin(),
            max: top,
        }
    }

    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>) {
        let near = self
            .patches
            .iter()
            .map(|patch| patch.closest(p))
            .filter(|s| (p - s.point).norm() <= reach);
        found.extend(near);
    }
}
