//! Parts made by hand, as STEP files for `test_step_file.py`: `step_parts FOLDER`.
//!
//! Lengths of the functions are in mm; z is up, and axes of round parts are along z. Curves of
//! adjacent faces come from `intersection`.

use std::error::Error;
use std::path::PathBuf;

use nalgebra::{Point3, Vector3};
use touchup_geometry::brep::{
    AnalyticSurface, AxisPlacement, Brep, BrepFace, BrepParts, FaceLoop, OrientedEdge, SpaceCurve,
    StandardUncertainty, SurfaceShape, UncertaintyUnit, intersection,
};
use touchup_io::step_file::{StepProduct, write_step};

type Made<T> = Result<T, Box<dyn Error>>;

const UP: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0);
const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -1.0);

fn at(x: f64, y: f64, z: f64) -> Point3<f64> {
    Point3::new(x, y, z) * 1e-3
}

fn plane(z: f64, normal: Vector3<f64>) -> AnalyticSurface {
    AnalyticSurface::along(at(0.0, 0.0, z), normal, SurfaceShape::Plane)
}

fn cylinder(x: f64, y: f64, radius: f64) -> AnalyticSurface {
    let radius = radius * 1e-3;
    AnalyticSurface::along(at(x, y, 0.0), UP, SurfaceShape::Cylinder { radius })
}

/// The common circle of two surfaces, counter-clockwise about z, as an edge of its own.
fn rim(parts: &mut BrepParts, a: &AnalyticSurface, b: &AnalyticSurface) -> Made<OrientedEdge> {
    let curves = intersection(a, b).ok_or("no form")?;
    let [curve] = &curves[..] else {
        return Err(format!("{} curves", curves.len()).into());
    };
    let axis = match curve {
        SpaceCurve::Circle { placement, .. } | SpaceCurve::Ellipse { placement, .. } => {
            placement.axis
        }
        other => return Err(format!("no closed conic: {other:?}").into()),
    };
    let ring = parts.ring(curve);
    Ok(if axis.z > 0.0 { ring } else { ring.reversed() })
}

fn one(edge: OrientedEdge) -> FaceLoop {
    FaceLoop::Edges(vec![edge])
}

/// Adds a face.
fn add(
    parts: &mut BrepParts,
    name: &str,
    surface: AnalyticSurface,
    is_outward: bool,
    loops: Vec<FaceLoop>,
) {
    parts
        .faces
        .push(BrepFace::new(name, surface, is_outward, loops));
}

/// Adds the wall of a vertical prism between two polygons, each seen from above, and returns their
/// loops.
fn prism(parts: &mut BrepParts, size: [f64; 3]) -> (FaceLoop, FaceLoop) {
    let [x, y, z] = size;
    let corners = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)];
    let low = corners.map(|(x, y)| parts.vertex(at(x, y, 0.0)));
    let high = corners.map(|(x, y)| parts.vertex(at(x, y, z)));
    for side in 0..4 {
        let next = (side + 1) % 4;
        let loops = vec![parts.polygon(&[low[side], low[next], high[next], high[side]])];
        let from = parts.vertices[low[side]];
        let normal = (parts.vertices[low[next]] - from).cross(&UP);
        let surface = AnalyticSurface::along(from, normal, SurfaceShape::Plane);
        add(parts, &format!("side {}", side + 1), surface, true, loops);
    }
    let [a, b, c, d] = low;
    (parts.polygon(&[d, c, b, a]), parts.polygon(&high))
}

fn cuboid() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (bottom, top) = prism(&mut parts, [10.0, 20.0, 30.0]);
    add(&mut parts, "bottom", plane(0.0, DOWN), true, vec![bottom]);
    add(&mut parts, "top", plane(30.0, UP), true, vec![top]);
    Ok(parts)
}

/// The box without its top.
fn tray() -> Made<BrepParts> {
    let mut parts = cuboid()?;
    parts.faces.pop();
    Ok(parts)
}

/// 60 by 40 by 20 with a through hole Ø 8 at (15, 20), and a blind one Ø 10 at (42, 20), 12 deep
/// to its drill tip of 118°.
fn plate() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (bottom, top) = prism(&mut parts, [60.0, 40.0, 20.0]);
    let (floor, lid) = (plane(0.0, DOWN), plane(20.0, UP));
    let (bore, blind) = (cylinder(15.0, 20.0, 4.0), cylinder(42.0, 20.0, 5.0));
    let half_angle = 59f64.to_radians();
    let shape = SurfaceShape::Cone {
        radius: 5e-3,
        half_angle,
    };
    let tip = AnalyticSurface::along(at(42.0, 20.0, 8.0), UP, shape);
    let low = rim(&mut parts, &bore, &floor)?;
    let high = rim(&mut parts, &bore, &lid)?;
    let mouth = rim(&mut parts, &blind, &lid)?;
    let end = rim(&mut parts, &blind, &tip)?;
    let apex = parts.vertex(at(42.0, 20.0, 8.0 - 5.0 / half_angle.tan()));
    add(&mut parts, "bottom", floor, true, vec![bottom, one(low)]);
    let holes = [high, mouth].map(|rim| one(rim.reversed()));
    add(
        &mut parts,
        "top",
        lid,
        true,
        [vec![top], holes.into()].concat(),
    );
    let walls = |low: OrientedEdge, high: OrientedEdge| vec![one(low.reversed()), one(high)];
    add(&mut parts, "through hole", bore, false, walls(low, high));
    add(&mut parts, "blind hole", blind, false, walls(end, mouth));
    let loops = vec![one(end), FaceLoop::Vertex(apex)];
    add(&mut parts, "drill tip", tip, false, loops);
    let uncertainty = |name: &str, value, unit| StandardUncertainty {
        name: name.to_owned(),
        value,
        unit,
    };
    for face in &mut parts.faces {
        face.uncertainties = match &*face.name {
            "through hole" => vec![
                uncertainty("diameter_mm", 0.0031, UncertaintyUnit::Millimetre),
                uncertainty("position_mm", 1e-7, UncertaintyUnit::Millimetre),
            ],
            "drill tip" => vec![uncertainty("cone_angle_deg", 0.25, UncertaintyUnit::Degree)],
            _ => continue,
        };
        face.is_touched = true;
    }
    Ok(parts)
}

/// Ø 30 by 20 with a bore Ø 6 and a counterbore Ø 12, 5 deep.
fn counterbore() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (floor, seat, lid) = (plane(0.0, DOWN), plane(15.0, UP), plane(20.0, UP));
    let (outside, bore, wide) = [15.0, 3.0, 6.0].map(|r| cylinder(0.0, 0.0, r)).into();
    let low = rim(&mut parts, &outside, &floor)?;
    let high = rim(&mut parts, &outside, &lid)?;
    let exit = rim(&mut parts, &bore, &floor)?;
    let step = rim(&mut parts, &bore, &seat)?;
    let corner = rim(&mut parts, &wide, &seat)?;
    let mouth = rim(&mut parts, &wide, &lid)?;
    let mut face = |name: &str, surface, is_outward, edges: [OrientedEdge; 2]| {
        add(&mut parts, name, surface, is_outward, edges.map(one).into());
    };
    face("bottom", floor, true, [low.reversed(), exit]);
    face("outside", outside, true, [low, high.reversed()]);
    face("top", lid, true, [high, mouth.reversed()]);
    face("counterbore", wide, false, [corner.reversed(), mouth]);
    face("seat", seat, true, [corner, step.reversed()]);
    face("bore", bore, false, [exit.reversed(), step]);
    Ok(parts)
}

/// 40 by 30 by 10 with a slot through it: ends of radius 4 at (14, 15) and (26, 15).
fn slot() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (bottom, top) = prism(&mut parts, [40.0, 30.0, 10.0]);
    let (floor, lid) = (plane(0.0, DOWN), plane(10.0, UP));
    let (left, right) = (cylinder(14.0, 15.0, 4.0), cylinder(26.0, 15.0, 4.0));
    // counter-clockwise from above: right end, back wall, left end, front wall
    let places = [(26.0, 11.0), (26.0, 19.0), (14.0, 19.0), (14.0, 11.0)];
    let mut outline = |z: f64| {
        let v = places.map(|(x, y)| parts.vertex(at(x, y, z)));
        let arc = |x: f64| SpaceCurve::Circle {
            placement: AxisPlacement::along(at(x, 15.0, z), UP),
            radius: 4e-3,
        };
        let right = parts.edge(&arc(26.0), v[0], v[1]);
        let left = parts.edge(&arc(14.0), v[2], v[3]);
        (
            v,
            [right, parts.line(v[1], v[2]), left, parts.line(v[3], v[0])],
        )
    };
    let ((low, low_edges), (high, high_edges)) = (outline(0.0), outline(10.0));
    let names = ["right end", "back wall", "left end", "front wall"];
    let wall = |y: f64, normal: f64| {
        let normal = Vector3::new(0.0, normal, 0.0);
        AnalyticSurface::along(at(20.0, y, 5.0), normal, SurfaceShape::Plane)
    };
    let surfaces = [
        (right, false),
        (wall(19.0, -1.0), true),
        (left, false),
        (wall(11.0, 1.0), true),
    ];
    for (side, (surface, is_outward)) in surfaces.into_iter().enumerate() {
        let next = (side + 1) % 4;
        let edges = vec![
            low_edges[side].reversed(),
            parts.line(low[side], high[side]),
            high_edges[side],
            parts.line(high[next], low[next]),
        ];
        add(
            &mut parts,
            names[side],
            surface,
            is_outward,
            vec![FaceLoop::Edges(edges)],
        );
    }
    let through = FaceLoop::Edges(low_edges.into());
    add(&mut parts, "bottom", floor, true, vec![bottom, through]);
    let edges = high_edges.iter().rev().map(|edge| edge.reversed());
    let through = FaceLoop::Edges(edges.collect());
    add(&mut parts, "top", lid, true, vec![top, through]);
    Ok(parts)
}

/// Ø 10, cut at 30° off the square through (0, 0, 20).
fn oblique() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (floor, wall) = (plane(0.0, DOWN), cylinder(0.0, 0.0, 5.0));
    let normal = Vector3::new(0.5, 0.0, 0.75f64.sqrt());
    let lid = AnalyticSurface::along(at(0.0, 0.0, 20.0), normal, SurfaceShape::Plane);
    let low = rim(&mut parts, &wall, &floor)?;
    let high = rim(&mut parts, &wall, &lid)?;
    add(&mut parts, "bottom", floor, true, vec![one(low.reversed())]);
    add(
        &mut parts,
        "wall",
        wall,
        true,
        [low, high.reversed()].map(one).into(),
    );
    add(&mut parts, "cut", lid, true, vec![one(high)]);
    Ok(parts)
}

/// Ø 20 by 30 with a hole Ø 8 across it along x, at a height of 15.
fn crossed() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (floor, lid) = (plane(0.0, DOWN), plane(30.0, UP));
    let wall = cylinder(0.0, 0.0, 10.0);
    let shape = SurfaceShape::Cylinder { radius: 4e-3 };
    let hole = AnalyticSurface::along(at(0.0, 0.0, 15.0), Vector3::x(), shape);
    let low = rim(&mut parts, &wall, &floor)?;
    let high = rim(&mut parts, &wall, &lid)?;
    let curves = intersection(&wall, &hole).ok_or("no form")?;
    let mut mouths = Vec::new();
    for curve in curves {
        let SpaceCurve::Spline(nodes) = &curve else {
            return Err("no general curve".into());
        };
        // an edge may begin anywhere on its curve; counter-clockwise about x
        let vertex = parts.vertex(nodes[nodes.len() / 3].point);
        let ring = parts.edge(&curve, vertex, vertex);
        let off = nodes[0].point - hole.placement.origin;
        let is_forward = off.cross(&nodes[0].tangent).x > 0.0;
        let ring = if is_forward { ring } else { ring.reversed() };
        mouths.push((nodes[0].point.x > 0.0, ring));
    }
    mouths.sort_by_key(|(is_right, _)| *is_right);
    let [(false, left), (true, right)] = mouths[..] else {
        return Err("a hole has two mouths".into());
    };
    add(&mut parts, "bottom", floor, true, vec![one(low.reversed())]);
    // from outside the right mouth is seen against x, the left one along it
    let loops = [low, high.reversed(), right.reversed(), left];
    add(&mut parts, "wall", wall, true, loops.map(one).into());
    let loops = [left.reversed(), right].map(one).into();
    add(&mut parts, "cross hole", hole, false, loops);
    add(&mut parts, "top", lid, true, vec![one(high)]);
    Ok(parts)
}

/// 80 by 40 by 20 with a dome of radius 13 about (20, 20, 15), a seat of radius 13 about (60, 20, 25),
/// and between them a hole Ø 4, 10 deep to the pole of its ball-nosed end.
fn spheres() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let (bottom, top) = prism(&mut parts, [80.0, 40.0, 20.0]);
    let (floor, lid) = (plane(0.0, DOWN), plane(20.0, UP));
    // the pole is on the face
    let ball = |x: f64, z: f64, radius: f64, pole| {
        let radius = radius * 1e-3;
        AnalyticSurface::along(at(x, 20.0, z), pole, SurfaceShape::Sphere { radius })
    };
    let (dome, seat) = (ball(20.0, 15.0, 13.0, UP), ball(60.0, 25.0, 13.0, DOWN));
    let (bore, nose) = (cylinder(40.0, 20.0, 2.0), ball(40.0, 12.0, 2.0, DOWN));
    let foot = rim(&mut parts, &dome, &lid)?;
    let edge = rim(&mut parts, &seat, &lid)?;
    let mouth = rim(&mut parts, &bore, &lid)?;
    // both touch there
    let equator = rim(&mut parts, &nose, &plane(12.0, UP))?;
    add(&mut parts, "bottom", floor, true, vec![bottom]);
    let holes = [foot, edge, mouth].map(|rim| one(rim.reversed()));
    let loops = [vec![top], holes.into()].concat();
    add(&mut parts, "top", lid, true, loops);
    add(&mut parts, "dome", dome, true, vec![one(foot)]);
    add(&mut parts, "seat", seat, false, vec![one(edge)]);
    let loops = [equator.reversed(), mouth].map(one).into();
    add(&mut parts, "bore", bore, false, loops);
    add(&mut parts, "nose", nose, false, vec![one(equator)]);
    Ok(parts)
}

/// A whole ball Ø 10.
fn ball() -> Made<BrepParts> {
    let mut parts = BrepParts::default();
    let shape = SurfaceShape::Sphere { radius: 5e-3 };
    let surface = AnalyticSurface::along(at(1.0, 2.0, 3.0), UP, shape);
    let pole = parts.vertex(at(1.0, 2.0, 8.0));
    add(
        &mut parts,
        "ball",
        surface,
        true,
        vec![FaceLoop::Vertex(pole)],
    );
    Ok(parts)
}

fn main() -> Made<()> {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("name a folder")?);
    std::fs::create_dir_all(&folder)?;
    let all = [
        ("box", cuboid as fn() -> Made<BrepParts>),
        ("tray", tray),
        ("plate", plate),
        ("counterbore", counterbore),
        ("slot", slot),
        ("oblique", oblique),
        ("crossed", crossed),
        ("spheres", spheres),
        ("ball", ball),
    ];
    for (name, part) in all {
        // 1 nm; general curves are right to 10 nm at 10 mm
        let tolerance = if name == "crossed" { 1e-8 } else { 1e-9 };
        let brep = Brep::new(part()?, tolerance).map_err(|error| format!("{name}: {error}"))?;
        let product = StepProduct {
            name: format!("the \"{name}\" of O'Neill, Ø"),
            time_stamp: None,
        };
        write_step(&folder.join(name).with_extension("step"), &brep, &product)?;
    }
    Ok(())
}
