//! Round holes and bosses: round walls with air, or material, inside.

use nalgebra::{Point3, Vector3};

use super::segmentation::rays::RayHit;
use super::segmentation::scene::SegmentedMesh;
use super::walls::Wall;
use touchup_geometry::mesh::{BoxQuery, FaceId};
use touchup_geometry::numeric::{median, tangent_basis};
use touchup_method::stylus::ProbedPoint;

/// A round hole.
#[derive(Clone, Debug)]
pub(super) struct Hole {
    /// number of its wall
    pub wall: usize,
    /// point of the axis in the opening, m, in O
    pub opening: Point3<f64>,
    /// unit vector out of the opening
    pub out: Vector3<f64>,
    /// m
    pub depth: f64,
    /// `None`: closed by neither a floor nor the tip of a drill, or the mesh ends there
    pub through: Option<bool>,
    /// number of the plane, or of the cylinder with the material inside, around the opening
    pub rim: Option<usize>,
    /// whether its wall is open to the side over its length: a cut at the rim of the part
    pub is_notch: bool,
    /// number of the plane of its floor
    pub floor: Option<usize>,
    /// number of the wall of its countersink
    pub countersink: Option<usize>,
}

/// A round boss.
#[derive(Clone, Debug)]
pub(super) struct Boss {
    pub wall: usize,
    /// middle of the foot, m, in O
    pub foot: Point3<f64>,
    /// unit vector from foot to top
    pub out: Vector3<f64>,
    /// m
    pub height: f64,
    /// numbers of the planes
    pub base: usize,
    pub top: Option<usize>,
    /// whether its base is the shoulder of a shaft
    pub is_turned: bool,
}

/// Minimum share of a turn of a hole's wall: a hole with a keyway or a slit still counts.
const HOLE_COVERAGE: f64 = 0.56;
/// Minimum share of a turn of a boss.
const BOSS_COVERAGE: f64 = 0.75;
/// Minimum coverage of a shaft below a shoulder, as a share of the coverage of the wall above.
const SHAFT_COVERAGE: f64 = 0.8;
/// Minimum share of a wall between its ends that faces cover.
const FILLED: f64 = 0.4;
/// Maximum area of a fragment of another wall, as a share of that.
const SMALLER: f64 = 0.5;
/// Tolerance of its position and radius, as a share of the radius.
const REST: f64 = 0.3;
/// Cosines of the lean of a countersink's face, 30° to 63°, its inner radius as a share of the outer,
/// and minimum number of contacts on it.
const CONE_COSINES: std::ops::Range<f64> = 0.45..0.87;
const CONE_FROM: f64 = 0.4;
const LEAST_ON_CONE: usize = 6;
/// Minimum tilt of its axis, 6° as a cosine, unless its radius is the same.
const STRAIGHT: f64 = 0.9945;
/// Minimum height of a wall, in radii: a rim rounded by noise is lower.
const LEAST_HEIGHT: f64 = 0.08;
/// Minimum free share of the radius around the axis in a hole; a line to the wall ends at the same
/// share beyond it.
const FREE: f64 = 0.5;
/// Number of points on the axis with lines to the wall, and of lines from each.
const PROBES: usize = 5;
const PROBE_RAYS: usize = 8;
/// Maximum distance of a hole's closure from the end of its wall, in radii.
const CLOSED: f64 = 1.0;
/// Distance within which a hit makes an end without a plane around it uncertain, in radii: the wall
/// may continue unseen.
const MAYBE_CLOSED: f64 = 3.0;
/// Offset of the rays for the closure of a hole from its axis, as a share of the radius.
const ASIDE: f64 = 0.05;
/// Rings around an opening, in its radii: the land beside a hole may be narrow.
const RINGS: [f64; 3] = [1.06, 1.15, 1.3];
/// Rings around a scanned or touched foot: a ball does not reach into its corner.
const FOOT_RINGS: [f64; 4] = [1.2, 1.35, 1.5, 1.8];
/// Maximum distance of a plane around an opening from the end of the wall, in radii.
const NEAR_END: f64 = 0.4;
/// Minimum share of the rings on a plane.
const RIM: f64 = 0.2;
/// A floor is square to the axis within 20°.
const SQUARE: f64 = 0.94;
/// Range of mesh borders that tear an end, before and behind it, in radii; also their maximum
/// distance from the axis.
const TORN: [f64; 2] = [0.5, 1.5];
/// Number of directions that examine an end.
const AROUND: usize = 24;
/// Minimum number of open directions of a notch: 45°.
const NOTCH: usize = 3;
/// Length of an open direction, in radii from the axis.
const OPEN: f64 = 3.0;
/// Maximum gap between walls of one hole along the axis, in radii.
const SAME_HOLE: f64 = 0.5;
/// Maximum distance of the axes of one stepped hole, as a share of the radius.
const SAME_AXIS: f64 = 0.15;
/// Heads of countersunk screws are 1.8 to 2 times as wide as their holes, broken edges seldom more
/// than 1.1 times.
const HEAD: f64 = 1.25;

/// One end of a wall.
#[derive(Clone, Copy, Debug)]
struct WallEnd {
    /// along the axis of the wall, m
    t: f64,
    /// out of the hole, ±1 times the axis
    out: f64,
    /// position of its closure, along the axis, m
    closed_at: Option<f64>,
    /// whether it has no closure; `false` also if a farther one is possible
    is_open: bool,
    /// land around it and its share of the ring
    rim: Option<(usize, f64)>,
}

impl WallEnd {
    /// Whether a hollow wall behind it has the same axis.
    fn goes_on_in(&self, wall: &Wall, other: &Wall) -> bool {
        let middle = other.at(other.middle());
        let beyond = (middle - wall.at(self.t)).dot(&wall.axis) * self.out;
        let near = SAME_AXIS * wall.radius().max(other.radius());
        // the axis of a short wall is hardly known
        let is_along = other.axis.dot(&wall.axis).abs() > SQUARE;
        other.is_concave && is_along && wall.is_about(&middle, near) && beyond > 0.0
    }
}

/// All round holes.
pub(super) fn holes(parted: &SegmentedMesh, walls: &[Wall], touches: &[ProbedPoint]) -> Vec<Hole> {
    let is_hole = |wall: &Wall| wall.is_concave && !wall.is_cone();
    let numbers = (0..walls.len()).filter(|&at| is_hole(&walls[at]));
    let numbers = numbers.filter(|&at| !is_rim_of_cone(parted, &walls[at], touches));
    let found: Vec<Hole> = numbers.filter_map(|at| hole(parted, walls, at)).collect();
    let is_of = |hole: &Hole, other: &Hole| {
        is_fragment_of(parted, &walls[hole.wall], &walls[other.wall])
            || is_far_mouth(parted, walls, hole, other)
    };
    found
        .iter()
        .filter(|hole| !found.iter().any(|other| is_of(hole, other)))
        .cloned()
        .collect()
}

/// Whether a wall, felt along one edge alone, is the border of a countersink: contacts within it lie
/// on a cone and not on a shoulder.
fn is_rim_of_cone(parted: &SegmentedMesh, wall: &Wall, touches: &[ProbedPoint]) -> bool {
    if !wall.is_edge {
        return false;
    }
    let (middle, radius) = (wall.at(wall.middle()), wall.radius());
    let felt = wall
        .segments
        .iter()
        .flat_map(|&at| &parted.segment(at).felt);
    let normals = felt.map(|felt| touches[felt.touch as usize].normal);
    let lean = normals.sum::<Vector3<f64>>().dot(&wall.axis);
    let out = wall.axis * lean.signum();
    let near = 2.0 * parted.segment(wall.segments[0]).tolerance;
    let is_within = |touch: &&ProbedPoint| {
        let v = touch.point - middle;
        let along = v.dot(&out);
        let aside = (v - out * along).norm();
        (-radius..-near).contains(&along) && (CONE_FROM * radius..radius - near).contains(&aside)
    };
    let cosines = touches
        .iter()
        .filter(is_within)
        .map(|touch| touch.normal.dot(&out));
    let (on_cone, others): (Vec<f64>, Vec<f64>) =
        cosines.partition(|cosine| CONE_COSINES.contains(cosine));
    let on_shoulder = others.iter().filter(|&&cosine| cosine > SQUARE);
    on_cone.len() >= LEAST_ON_CONE && on_cone.len() > 2 * on_shoulder.count()
}

/// Whether a wall is a fragment of the same hole as a better one: with few touches it is crooked.
fn is_fragment_of(parted: &SegmentedMesh, wall: &Wall, better: &Wall) -> bool {
    let (part, whole) = (
        parted.segment(wall.segments[0]),
        parted.segment(better.segments[0]),
    );
    let v = wall.at(wall.middle()) - better.origin;
    let along = v.dot(&better.axis);
    let aside = (v - better.axis * along).norm();
    let beyond = (better.ends[0] - along).max(along - better.ends[1]);
    let wider = (wall.radius() - better.radius()).abs();
    // a step of the hole would be straight, and of another radius
    let is_crooked = wall.axis.dot(&better.axis).abs() < STRAIGHT;
    !part.is_exact
        && part.area < SMALLER * whole.area
        && (is_crooked || wider < part.tolerance)
        && wider.max(aside) < REST * better.radius()
        && beyond < better.radius() + wall.height()
}

/// Whether a hole is the far mouth of a larger one: both go through, each opens where the other
/// ends, and the part goes on between them. Mouths felt along their edges alone have walls that
/// lean.
fn is_far_mouth(parted: &SegmentedMesh, walls: &[Wall], hole: &Hole, larger: &Hole) -> bool {
    let [wall, of_larger] = [hole, larger].map(|hole| &walls[hole.wall]);
    let apart = larger.opening - hole.opening;
    let (through, radius) = (apart.normalize(), of_larger.radius());
    let is_facing = hole.wall > larger.wall
        && hole.through == Some(true)
        && larger.through == Some(true)
        && (wall.radius() - radius).abs() < SAME_AXIS * radius
        && hole.out.dot(&through) < -SQUARE
        && larger.out.dot(&through) > SQUARE;
    if !is_facing {
        return false;
    }
    // from inside of a plate a line meets the back of its face
    let (middle, [e, g]) = (hole.opening + apart / 2.0, tangent_basis(&through));
    let mut rays = parted.around(wall.segments[0]).rays(radius);
    let mut is_inside = |aside: &Vector3<f64>| {
        let met = rays.first(
            &(middle + aside * (RINGS[1] * radius)),
            &through,
            apart.norm(),
        );
        met.is_some_and(|met| parted.facets.normal(met.face.0).dot(&through) > 0.0)
    };
    let inside = [e, -e, g, -g]
        .iter()
        .filter(|aside| is_inside(aside))
        .count();
    inside >= 2
}

fn hole(parted: &SegmentedMesh, walls: &[Wall], at: usize) -> Option<Hole> {
    let wall = &walls[at];
    let radius = wall.radius();
    // a ball that went around a wall was inside of it: mesh there is an untouched plug, and missing
    // mesh a gap
    let is_felt = wall.felt_turn > 0.0;
    let is_whole = wall.coverage >= HOLE_COVERAGE && (is_felt || wall.filled >= FILLED);
    if !is_whole || !is_felt && (wall.height() < LEAST_HEIGHT * radius || !is_free(parted, wall)) {
        return None;
    }
    let ends = [end(parted, wall, 0), end(parted, wall, 1)];
    let open = match ends.map(|end| end.closed_at.is_none()) {
        // a plug
        [false, false] if is_felt => {
            usize::from(openness(walls, at, &ends[1]) > openness(walls, at, &ends[0]))
        }
        [false, false] => return None,
        [true, false] => 0,
        [false, true] => 1,
        [true, true] => usize::from(openness(walls, at, &ends[1]) > openness(walls, at, &ends[0])),
    };
    let (open, other) = (ends[open], ends[1 - open]);
    let middle = wall.middle();
    let on_land = |end: &WallEnd| {
        let (number, _) = end.rim?;
        let t = middle + parted.exit(number, &wall.at(middle), &(wall.axis * end.out))? * end.out;
        ((t - end.t).abs() < NEAR_END * radius).then_some((number, t))
    };
    let rim = on_land(&open);
    let is_notch = !is_felt && is_notch(parted, wall, &open);
    if is_notch && rim.is_none() {
        return None;
    }
    let top = rim.map_or(open.t, |(_, t)| t);
    let tip = cone_beside(walls, at, &other)
        .filter(|&cone| walls[cone].axis.dot(&wall.axis) * other.out < 0.0);
    // at the tip of a drill the depth is that of the cylinder
    let closed_at = other.closed_at.filter(|_| tip.is_none());
    let floor = match narrower(parted, walls, at, &other) {
        // a floor farther on is that of the narrower hole
        Some(next) => shoulder(parted, wall, next, &other).map(|plane| (plane, other.t)),
        None => closed_at.and_then(|t| Some((floor_at(parted, wall, t)?, t))),
    };
    // a head felt along its border alone shows no shoulder
    let floor = floor.filter(|(number, _)| rim.is_none_or(|(land, _)| land != *number));
    let bottom = match other.closed_at {
        Some(_) => floor.map_or(other.t, |(_, t)| t),
        None => floor
            .map(|(_, t)| t)
            .or_else(|| Some(on_land(&other)?.1))
            .unwrap_or(other.t),
    };
    Some(Hole {
        wall: at,
        opening: wall.at(top),
        out: wall.axis * open.out,
        depth: (top - bottom).abs(),
        through: match other.closed_at {
            None => (other.is_open && !is_torn(parted, wall, &other)).then_some(true),
            Some(_) => (floor.is_some() || tip.is_some()).then_some(false),
        },
        rim: rim.map(|(number, _)| number),
        floor: floor.map(|(number, _)| number),
        is_notch,
        countersink: cone_beside(walls, at, &open)
            .filter(|&cone| is_countersink(&walls[cone], wall, open.out)),
    })
}

/// The narrower hole that continues a hole.
fn narrower<'a>(
    parted: &SegmentedMesh,
    walls: &'a [Wall],
    at: usize,
    end: &WallEnd,
) -> Option<&'a Wall> {
    let wall = &walls[at];
    let tolerance = |wall: &Wall| parted.segment(wall.segments[0]).tolerance;
    let is_next = |next: &&Wall| {
        !next.is_cone()
            && next.coverage >= HOLE_COVERAGE
            && next.radius() + tolerance(next) < wall.radius() - tolerance(wall)
            && end.goes_on_in(wall, next)
    };
    let nearest = |a: &&Wall, b: &&Wall| a.gap(wall).abs().total_cmp(&b.gap(wall).abs());
    walls.iter().filter(is_next).min_by(nearest)
}

/// The plane at which a hole narrows.
fn shoulder(parted: &SegmentedMesh, wall: &Wall, next: &Wall, end: &WallEnd) -> Option<usize> {
    if next.gap(wall).abs() > SAME_HOLE * wall.radius() {
        return None;
    }
    let ring = [(wall.radius() + next.radius()) / 2.0];
    let (middle, opening) = (wall.at(end.t), wall.axis * -end.out);
    let around = parted.around(wall.segments[0]);
    parted
        .plane_around(&around, &middle, &opening, &ring, NEAR_END * wall.radius())
        .map(|(number, _)| number)
}

/// Whether a wall is a cut at the rim of the part: beside its open side neither a wall nor the land
/// around the opening continues.
fn is_notch(parted: &SegmentedMesh, wall: &Wall, end: &WallEnd) -> bool {
    let (radius, around) = (wall.radius(), parted.around(wall.segments[0]));
    let [e, g] = tangent_basis(&wall.axis);
    let mut rays = around.rays(radius);
    let mut is_open = |i: usize| {
        let (sine, cosine) = (std::f64::consts::TAU * (i as f64 + 0.3) / AROUND as f64).sin_cos();
        let along = e * cosine + g * sine;
        let is_beside = around
            .closest(
                &(wall.at(end.t) + along * (RINGS[1] * radius)),
                NEAR_END * radius,
            )
            .is_some();
        [
            !is_beside,
            rays.first(&wall.at(wall.middle()), &along, OPEN * radius)
                .is_none(),
        ]
    };
    let open: Vec<[bool; 2]> = (0..AROUND).map(&mut is_open).collect();
    let widest = |which: usize| {
        let run = |start: usize| {
            (0..AROUND)
                .take_while(|i| open[(start + i) % AROUND][which])
                .count()
        };
        (0..AROUND).map(run).max().unwrap_or(0)
    };
    widest(0) > 0 && widest(1) >= NOTCH
}

/// Whether most lines from the axis to the wall are free. The closure of the hole, however shallow,
/// does not matter.
fn is_free(parted: &SegmentedMesh, wall: &Wall) -> bool {
    let radius = wall.radius();
    let [e, g] = tangent_basis(&wall.axis);
    let mut rays = parted.around(wall.segments[0]).rays(radius);
    let mut free = 0;
    for i in 0..PROBES {
        let start = wall.at(wall.ends[0] + wall.height() * (i as f64 + 0.5) / PROBES as f64);
        for k in 0..PROBE_RAYS {
            let (sine, cosine) =
                (std::f64::consts::TAU * (k as f64 + 0.3) / PROBE_RAYS as f64).sin_cos();
            let along = e * cosine + g * sine;
            let met = rays.first(&start, &along, (1.0 + FREE) * radius);
            // a hit from behind is material around the axis
            let is_free = |met: RayHit| {
                met.distance > FREE * radius && parted.facets.normal(met.face.0).dot(&along) < 0.0
            };
            free += usize::from(met.is_none_or(is_free));
        }
    }
    // a scanned lid, or a chip, may close a part of it
    2 * free >= PROBES * PROBE_RAYS
}

fn end(parted: &SegmentedMesh, wall: &Wall, which: usize) -> WallEnd {
    let (t, out) = (wall.ends[which], if which == 0 { -1.0 } else { 1.0 });
    let radius = wall.radius();
    let middle = wall.middle();
    let around = parted.around(wall.segments[0]);
    let rings = RINGS.map(|ring| ring * radius);
    let rim = parted.land_around(
        &around,
        &wall.at(t),
        &(wall.axis * out),
        &rings,
        NEAR_END * radius,
    );
    let rim = rim.filter(|&(_, share)| share > RIM);
    let reach = [CLOSED, MAYBE_CLOSED].map(|radii| wall.height() / 2.0 + radii * radius);
    // beside the axis: on it lie the tips of cones and the edges of floors, through which a line
    // may slip
    let [e, g] = tangent_basis(&wall.axis);
    let mut rays = around.rays(radius);
    let mut met = [0.4f64, 2.5, 4.6].map(|turn| {
        let aside = (e * turn.cos() + g * turn.sin()) * (ASIDE * radius);
        rays.first(&(wall.at(middle) + aside), &(wall.axis * out), reach[1])
            .map_or(f64::INFINITY, |met| met.distance)
    });
    met.sort_by(f64::total_cmp);
    let closed_at = (met[1] <= reach[0]).then(|| middle + out * met[1]);
    let is_open = closed_at.is_none() && (rim.is_some() || met[1].is_infinite());
    WallEnd {
        t,
        out,
        closed_at,
        is_open,
        rim,
    }
}

/// Whether the mesh ends there: the continuation of the wall is neither scanned nor touched. With a
/// plane around the end, the border must be as long as half of the turn.
fn is_torn(parted: &SegmentedMesh, wall: &Wall, end: &WallEnd) -> bool {
    let (middle, [e, g]) = (wall.at(end.t), tangent_basis(&wall.axis));
    let near = TORN.map(|radii| radii * wall.radius());
    // of a box that holds all of them, however the axis lies
    let reach = Vector3::repeat(near[1] * f64::sqrt(2.0));
    let mut found = BoxQuery::default();
    parted
        .tree
        .faces_in_box(&(middle - reach), &(middle + reach), &mut found);
    let mut torn = [false; AROUND];
    for &FaceId(face) in &found.faces {
        for [from, to] in parted
            .facets
            .open_edges(face)
            .map(|edge| parted.facets.edge(face, edge))
        {
            let v = from + (to - from) / 2.0 - middle;
            let (along, aside) = (v.dot(&wall.axis) * end.out, v.cross(&wall.axis).norm());
            if along > -near[0] && along < near[1] && aside < near[1] {
                let turn = v.dot(&g).atan2(v.dot(&e)).rem_euclid(std::f64::consts::TAU);
                torn[(turn / std::f64::consts::TAU * AROUND as f64) as usize % AROUND] = true;
            }
        }
    }
    let torn = torn.iter().filter(|torn| **torn).count();
    2 * torn >= if end.rim.is_some() { AROUND } else { 1 }
}

/// Score of an end as the opening, against the other end.
fn openness(walls: &[Wall], at: usize, end: &WallEnd) -> f64 {
    let wall = &walls[at];
    let is_near = |other: &Wall| other.gap(wall) < SAME_HOLE * wall.radius();
    let is_next = |other: &&Wall| {
        end.goes_on_in(wall, other) && other.coverage >= HOLE_COVERAGE && is_near(other)
    };
    let (before, after) = (&walls[..at], &walls[at + 1..]);
    let next = before.iter().chain(after).find(is_next);
    let stepped = next.map_or(0.0, |next| 2.0 * (next.radius() - wall.radius()).signum());
    stepped + end.rim.map_or(0.0, |(_, share)| share)
}

/// The cone that continues an end.
fn cone_beside(walls: &[Wall], at: usize, end: &WallEnd) -> Option<usize> {
    let wall = &walls[at];
    let is_near = |cone: &Wall| cone.gap(wall).abs() < SAME_HOLE * wall.radius();
    let is_next =
        |cone: &Wall| cone.is_cone() && cone.coverage > HOLE_COVERAGE && end.goes_on_in(wall, cone);
    walls.iter().position(|cone| is_next(cone) && is_near(cone))
}

/// Whether a cone at the opening of a hole is wide enough for the head of a screw, not a broken
/// edge.
fn is_countersink(cone: &Wall, wall: &Wall, out: f64) -> bool {
    cone.axis.dot(&wall.axis) * out > 0.0 && cone.radius_at(cone.ends[1]) > HEAD * wall.radius()
}

/// The plane square to the axis that closes a wall at `t`.
fn floor_at(parted: &SegmentedMesh, wall: &Wall, t: f64) -> Option<usize> {
    let number = parted.segment_at(
        &parted.around(wall.segments[0]),
        &wall.at(t),
        NEAR_END * wall.radius(),
    )?;
    (parted.plane(number)?.normal().dot(&wall.axis).abs() > SQUARE).then_some(number)
}

/// Groups of holes that follow each other on one axis: the group of each, `None` for a single hole.
pub(super) fn groups(walls: &[Wall], holes: &[Hole]) -> Vec<Option<u32>> {
    let mut group = vec![None; holes.len()];
    for i in 0..holes.len() {
        for j in 0..i {
            let (a, b) = (&walls[holes[i].wall], &walls[holes[j].wall]);
            if a.is_coaxial(b, SAME_AXIS) && a.gap(b) < SAME_HOLE * a.radius().max(b.radius()) {
                let number = group[j].unwrap_or(j as u32);
                (group[i], group[j]) = (Some(number), Some(number));
            }
        }
    }
    group
}

/// All round bosses, and steps of shafts: walls with material inside on a plane as foot.
pub(super) fn bosses(parted: &SegmentedMesh, walls: &[Wall]) -> Vec<Boss> {
    let is_boss =
        |wall: &Wall| !wall.is_concave && !wall.is_cone() && wall.coverage >= BOSS_COVERAGE;
    (0..walls.len())
        .filter(|&at| is_boss(&walls[at]))
        .filter_map(|at| boss(parted, walls, at))
        .collect()
}

/// Whether a wall carries the shoulder of another wall, which stands on it at `foot`, `out` being
/// ±1 times its axis.
fn is_shaft_below(wider: &Wall, wall: &Wall, foot: f64, out: f64) -> bool {
    let is_round = !wider.is_concave && wider.coverage >= SHAFT_COVERAGE * wall.coverage;
    let is_round = is_round && wider.radius() > wall.radius();
    let beyond = (wider.at(wider.middle()) - wall.at(foot)).dot(&wall.axis) * out;
    is_round
        && wider.is_coaxial(wall, SAME_AXIS)
        && beyond < 0.0
        && wider.gap(wall) < SAME_HOLE * wall.radius()
}

/// Whether the part is round about the axis of a wall below its shoulder at `foot`, whatever the
/// segmentation there: a badly scanned shaft, touched in strips.
fn is_round_below(parted: &SegmentedMesh, wall: &Wall, foot: f64, out: f64) -> bool {
    let (radius, axis, middle) = (wall.radius(), wall.axis, wall.at(foot));
    let reach = Vector3::repeat(BELOW_RADII[1] * radius);
    let mut query = BoxQuery::default();
    parted
        .tree
        .faces_in_box(&(middle - reach), &(middle + reach), &mut query);
    let mut far: [Vec<f64>; BELOW_PARTS] = Default::default();
    let [e, g] = tangent_basis(&axis);
    for face in query.faces.iter().map(|face| face.0) {
        let v = parted.facets.mesh.barycentre(FaceId(face)) - middle;
        let below = -v.dot(&axis) * out;
        let across = v - axis * v.dot(&axis);
        let distance = across.norm();
        let is_there = BELOW.contains(&(below / radius))
            && (BELOW_RADII[0]..BELOW_RADII[1]).contains(&(distance / radius));
        if is_there && parted.facets.normal(face).dot(&across) > BELOW_RADIAL * distance {
            let turn = across.dot(&g).atan2(across.dot(&e)) / std::f64::consts::TAU;
            far[((turn * BELOW_PARTS as f64).floor() as i64).rem_euclid(BELOW_PARTS as i64)
                as usize]
                .push(distance);
        }
    }
    let mut of_parts: Vec<f64> = far.iter_mut().filter_map(|of| median(of)).collect();
    let Some(usual) = median(&mut of_parts.clone()) else {
        return false;
    };
    of_parts.retain(|of| (of - usual).abs() < BELOW_ALIKE * usual);
    of_parts.len() as f64 >= BELOW_SHARE * BELOW_PARTS as f64
}

/// A part is round below a shoulder if a minimum share of the parts of a turn has faces in a range
/// below it and a range from the axis, both in radii of the wall above, with normals radial within
/// 20° and distances from the axis alike within a share.
const BELOW_PARTS: usize = 24;
const BELOW_SHARE: f64 = 0.75;
const BELOW: std::ops::Range<f64> = 0.1..1.0;
const BELOW_RADII: [f64; 2] = [1.05, 3.0];
const BELOW_RADIAL: f64 = 0.94;
const BELOW_ALIKE: f64 = 0.1;

fn boss(parted: &SegmentedMesh, walls: &[Wall], at: usize) -> Option<Boss> {
    let wall = &walls[at];
    let (radius, around) = (wall.radius(), parted.around(wall.segments[0]));
    let rings = if parted.rounding.is_some() {
        &RINGS[..]
    } else {
        &FOOT_RINGS[..]
    };
    let rings: Vec<f64> = rings.iter().map(|ring| ring * radius).collect();
    [(0, 1.0), (1, -1.0)].into_iter().find_map(|(which, out)| {
        let (foot, top) = (wall.ends[which], wall.ends[1 - which]);
        let direction = wall.axis * out;
        let base = |rings: &[f64]| {
            parted.plane_around(
                &around,
                &wall.at(foot),
                &direction,
                rings,
                NEAR_END * radius,
            )
        };
        let (base, share) = match parted.rounding {
            Some(_) => base(&rings)?,
            // the corner at the foot may be as wide as the ball
            None => rings
                .iter()
                .filter_map(|&ring| base(&[ring]))
                .max_by(|a, b| a.1.total_cmp(&b.1))?,
        };
        if share < 2.0 * RIM || wall.height() < LEAST_HEIGHT * radius {
            return None;
        }
        let to_plane = |number: usize| parted.plane(number)?.along(&wall.origin, &wall.axis);
        let foot = to_plane(base)?;
        let lid = parted.plane_around(
            &around,
            &wall.at(top),
            &direction,
            &[FREE * radius],
            NEAR_END * radius,
        );
        let lid = lid.map(|(number, _)| number);
        let top = lid.and_then(to_plane).unwrap_or(top);
        let height = (top - foot) * out;
        let is_turned = walls
            .iter()
            .any(|wider| is_shaft_below(wider, wall, foot, out))
            || parted.rounding.is_none() && is_round_below(parted, wall, foot, out);
        let foot = wall.at(foot);
        (height > 0.0).then_some(Boss {
            wall: at,
            foot,
            out: direction,
            height,
            base,
            top: lid,
            is_turned,
        })
    })
}
