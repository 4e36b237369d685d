//! Elements of a boundary, before the check.

use nalgebra::Point3;

use super::curve::SpaceCurve;
use super::placement::AxisPlacement;
use super::surface::AnalyticSurface;

/// Arc of a curve between two vertices, in the direction of the curve.
#[derive(Clone, Debug, PartialEq)]
pub struct BrepEdge {
    /// its curve
    pub curve: SpaceCurve,
    /// vertex at its beginning
    pub start: usize,
    /// vertex at its end; the same for a closed edge
    pub end: usize,
}

/// Edge in a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrientedEdge {
    /// its number
    pub edge: usize,
    /// whether the loop runs from its start to its end
    pub is_forward: bool,
}

impl OrientedEdge {
    /// From start to end.
    pub fn forward(edge: usize) -> Self {
        Self {
            edge,
            is_forward: true,
        }
    }

    /// The same edge in the other direction.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self {
            is_forward: !self.is_forward,
            ..self
        }
    }
}

/// Bound of a face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FaceLoop {
    /// each edge begins at the end of the one before it; the face is on the left, seen from outside
    /// of the part
    Edges(Vec<OrientedEdge>),
    /// the apex of a cone, or the pole of a whole sphere
    Vertex(usize),
}

impl FaceLoop {
    /// Its edges in order; none of a vertex.
    pub fn edges(&self) -> &[OrientedEdge] {
        match self {
            Self::Edges(edges) => edges,
            Self::Vertex(_) => &[],
        }
    }
}

/// Unit of a standard uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UncertaintyUnit {
    /// mm
    Millimetre,
    /// °
    Degree,
}

/// Standard uncertainty of one number of a face.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardUncertainty {
    /// of the number, such as `diameter_mm`
    pub name: String,
    /// one standard deviation, not negative
    pub value: f64,
    /// of the value
    pub unit: UncertaintyUnit,
}

/// Trimmed surface.
#[derive(Clone, Debug, PartialEq)]
pub struct BrepFace {
    /// such as `bore 3`
    pub name: String,
    /// whole surface
    pub surface: AnalyticSurface,
    /// whether the outward side of the surface is outside of the part: not so in a hole
    pub is_outward: bool,
    /// the outer loop of a plane first
    pub loops: Vec<FaceLoop>,
    /// false: from the scan alone
    pub is_touched: bool,
    /// of its numbers
    pub uncertainties: Vec<StandardUncertainty>,
}

impl BrepFace {
    /// Untouched, without uncertainties.
    pub fn new(
        name: &str,
        surface: AnalyticSurface,
        is_outward: bool,
        loops: Vec<FaceLoop>,
    ) -> Self {
        Self {
            name: name.to_owned(),
            surface,
            is_outward,
            loops,
            is_touched: false,
            uncertainties: Vec::new(),
        }
    }

    /// The edges of all loops.
    pub fn edges(&self) -> impl Iterator<Item = &OrientedEdge> {
        self.loops.iter().flat_map(FaceLoop::edges)
    }
}

/// Elements of a boundary; one refers to another by its number in the list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrepParts {
    /// m
    pub vertices: Vec<Point3<f64>>,
    /// between vertices
    pub edges: Vec<BrepEdge>,
    /// with loops of edges
    pub faces: Vec<BrepFace>,
}

impl BrepParts {
    /// Vertices at the beginning and the end of an edge in its loop.
    pub fn ends(&self, one: &OrientedEdge) -> [usize; 2] {
        let edge = &self.edges[one.edge];
        if one.is_forward {
            [edge.start, edge.end]
        } else {
            [edge.end, edge.start]
        }
    }

    /// Points along an edge, with both ends, in the direction of its loop.
    pub fn points(&self, one: &OrientedEdge) -> Vec<Point3<f64>> {
        let edge = &self.edges[one.edge];
        let [from, to] = [edge.start, edge.end].map(|vertex| self.vertices[vertex]);
        let mut points = edge.curve.points(&from, &to);
        if !one.is_forward {
            points.reverse();
        }
        points
    }

    /// Adds a vertex.
    pub fn vertex(&mut self, point: Point3<f64>) -> usize {
        self.vertices.push(point);
        self.vertices.len() - 1
    }

    /// Adds an edge: a curve trimmed to its vertices.
    pub fn edge(&mut self, curve: &SpaceCurve, start: usize, end: usize) -> OrientedEdge {
        let curve = match (self.vertices.get(start), self.vertices.get(end)) {
            (Some(from), Some(to)) => curve.trimmed(from, to),
            // the check names the missing vertex
            _ => curve.clone(),
        };
        self.edges.push(BrepEdge { curve, start, end });
        OrientedEdge::forward(self.edges.len() - 1)
    }

    /// The straight edge between two vertices, once for both directions.
    pub fn line(&mut self, start: usize, end: usize) -> OrientedEdge {
        let is_line = |edge: &BrepEdge| matches!(edge.curve, SpaceCurve::Line { .. });
        let lines = self.edges.iter().enumerate().filter(|(_, e)| is_line(e));
        let ends = lines.map(|(at, edge)| (at, (edge.start, edge.end)));
        let mut same = ends.filter(|(_, ends)| [(start, end), (end, start)].contains(ends));
        if let Some((edge, ends)) = same.next() {
            let is_forward = ends == (start, end);
            return OrientedEdge { edge, is_forward };
        }
        let place = |vertex: usize| self.vertices.get(vertex).copied().unwrap_or_default();
        let along = AxisPlacement::along(place(start), place(end) - place(start));
        let curve = SpaceCurve::Line {
            origin: along.origin,
            direction: along.axis,
        };
        self.edge(&curve, start, end)
    }

    /// Adds a closed edge with a vertex of its own.
    pub fn ring(&mut self, curve: &SpaceCurve) -> OrientedEdge {
        let vertex = self.vertex(curve.begin());
        self.edge(curve, vertex, vertex)
    }

    /// The loop of straight edges through vertices.
    pub fn polygon(&mut self, vertices: &[usize]) -> FaceLoop {
        let after = vertices.iter().cycle().skip(1);
        let edges = vertices.iter().zip(after).map(|(a, b)| self.line(*a, *b));
        FaceLoop::Edges(edges.collect())
    }
}
