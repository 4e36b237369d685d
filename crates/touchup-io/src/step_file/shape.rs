//! Geometry and topology: surfaces, curves, edges, faces, shells.

use nalgebra::Point3;
use touchup_geometry::brep::{
    AnalyticSurface, AxisPlacement, Brep, BrepFace, BrepParts, FaceLoop, OrientedEdge, SpaceCurve,
    SurfaceShape, spline_form,
};

use super::instances::{InstanceId, Instances, list, logical, millimetres, real, string};

/// Items of a shape.
pub(super) struct ShapeItems {
    /// of each face
    pub(super) faces: Vec<InstanceId>,
    /// solids, then the model of the open shells
    pub(super) items: Vec<InstanceId>,
    /// kind of the representation that may hold them
    pub(super) representation: &'static str,
}

/// Adds a boundary: each closed shell a solid, all open ones a surface model.
pub(super) fn add_shape(out: &mut Instances, brep: &Brep) -> ShapeItems {
    let parts = brep.parts();
    let vertex = |out: &mut Instances, p: &Point3<f64>| {
        let point = out.point(p);
        out.add(&format!("VERTEX_POINT('',{point})"))
    };
    let vertices: Vec<_> = parts.vertices.iter().map(|p| vertex(out, p)).collect();
    let edges = add_edges(out, parts, &vertices);
    let face = |face: &BrepFace| add_face(out, face, &vertices, &edges);
    let faces: Vec<_> = parts.faces.iter().map(face).collect();
    let (mut items, mut open) = (Vec::new(), Vec::new());
    for shell in brep.shells() {
        let of_shell: Vec<_> = shell.faces.iter().map(|face| faces[*face]).collect();
        let of_shell = list(&of_shell);
        if shell.is_closed {
            let shell = out.add(&format!("CLOSED_SHELL('',{of_shell})"));
            items.push(out.add(&format!("MANIFOLD_SOLID_BREP('',{shell})")));
        } else {
            open.push(out.add(&format!("OPEN_SHELL('',{of_shell})")));
        }
    }
    let representation = match (items.is_empty(), open.is_empty()) {
        (_, true) => "ADVANCED_BREP_SHAPE_REPRESENTATION",
        (true, false) => "MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
        (false, false) => "SHAPE_REPRESENTATION",
    };
    if !open.is_empty() {
        items.push(out.add(&format!("SHELL_BASED_SURFACE_MODEL('',{})", list(&open))));
    }
    ShapeItems {
        faces,
        items,
        representation,
    }
}

fn add_edges(out: &mut Instances, parts: &BrepParts, vertices: &[InstanceId]) -> Vec<InstanceId> {
    let edge = |edge: &touchup_geometry::brep::BrepEdge| {
        let curve = add_curve(out, &edge.curve);
        let (start, end) = (vertices[edge.start], vertices[edge.end]);
        out.add(&format!("EDGE_CURVE('',{start},{end},{curve},.T.)"))
    };
    parts.edges.iter().map(edge).collect()
}

/// Adds axes at a point.
pub(super) fn add_placement(out: &mut Instances, placement: &AxisPlacement) -> InstanceId {
    let origin = out.point(&placement.origin);
    let axis = out.direction(&placement.axis);
    let reference = out.direction(&placement.reference);
    out.add(&format!(
        "AXIS2_PLACEMENT_3D('',{origin},{axis},{reference})"
    ))
}

fn add_surface(out: &mut Instances, surface: &AnalyticSurface) -> InstanceId {
    let at = add_placement(out, &surface.placement);
    let entity = match surface.shape {
        SurfaceShape::Plane => format!("PLANE('',{at})"),
        SurfaceShape::Cylinder { radius } => {
            format!("CYLINDRICAL_SURFACE('',{at},{})", millimetres(radius))
        }
        SurfaceShape::Cone { radius, half_angle } => {
            let (radius, half_angle) = (millimetres(radius), real(half_angle));
            format!("CONICAL_SURFACE('',{at},{radius},{half_angle})")
        }
        SurfaceShape::Sphere { radius } => {
            format!("SPHERICAL_SURFACE('',{at},{})", millimetres(radius))
        }
    };
    out.add(&entity)
}

fn add_curve(out: &mut Instances, curve: &SpaceCurve) -> InstanceId {
    let entity = match curve {
        SpaceCurve::Line { origin, direction } => {
            let (point, direction) = (out.point(origin), out.direction(direction));
            let vector = out.add(&format!("VECTOR('',{direction},1.0)"));
            format!("LINE('',{point},{vector})")
        }
        SpaceCurve::Circle { placement, radius } => {
            let at = add_placement(out, placement);
            format!("CIRCLE('',{at},{})", millimetres(*radius))
        }
        SpaceCurve::Ellipse {
            placement,
            major,
            minor,
        } => {
            let at = add_placement(out, placement);
            let [major, minor] = [*major, *minor].map(millimetres);
            format!("ELLIPSE('',{at},{major},{minor})")
        }
        SpaceCurve::Spline(nodes) => {
            let form = spline_form(nodes);
            let points: Vec<_> = form.control_points.iter().map(|p| out.point(p)).collect();
            let ends = form.knots.len().saturating_sub(1);
            let times = |at: usize| if at == 0 || at == ends { "4" } else { "2" };
            let multiplicities: Vec<_> = (0..form.knots.len()).map(times).collect();
            let knots: Vec<_> = form.knots.iter().map(|knot| millimetres(*knot)).collect();
            let is_closed = logical(nodes.first() == nodes.last());
            format!(
                "B_SPLINE_CURVE_WITH_KNOTS('',3,{},.UNSPECIFIED.,{is_closed},.U.,({}),({}),.UNSPECIFIED.)",
                list(&points),
                multiplicities.join(","),
                knots.join(","),
            )
        }
    };
    out.add(&entity)
}

fn add_face(
    out: &mut Instances,
    face: &BrepFace,
    vertices: &[InstanceId],
    edges: &[InstanceId],
) -> InstanceId {
    let is_plane = face.surface.shape == SurfaceShape::Plane;
    let mut bounds = Vec::new();
    for (at, face_loop) in face.loops.iter().enumerate() {
        let of_face = match face_loop {
            FaceLoop::Vertex(vertex) => out.add(&format!("VERTEX_LOOP('',{})", vertices[*vertex])),
            FaceLoop::Edges(of_loop) => {
                let oriented = |one: &OrientedEdge| {
                    let (edge, is_forward) = (edges[one.edge], logical(one.is_forward));
                    out.add(&format!("ORIENTED_EDGE('',*,*,{edge},{is_forward})"))
                };
                let of_loop: Vec<_> = of_loop.iter().map(oriented).collect();
                out.add(&format!("EDGE_LOOP('',{})", list(&of_loop)))
            }
        };
        // no loop of a periodic surface is the outer one
        let kind = if is_plane && at == 0 {
            "FACE_OUTER_BOUND"
        } else {
            "FACE_BOUND"
        };
        bounds.push(out.add(&format!("{kind}('',{of_face},.T.)")));
    }
    let surface = add_surface(out, &face.surface);
    out.add(&format!(
        "ADVANCED_FACE({},{},{surface},{})",
        string(&face.name),
        list(&bounds),
        logical(face.is_outward),
    ))
}
