//! Report on a surface made from points.

use std::fmt;

use serde::Serialize;

/// Source of the outward orientation of the normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalSource {
    /// the file
    File,
    /// estimated, oriented towards the scanner position
    Scanner,
    /// estimated, oriented along a minimum spanning tree of the points [Hoppe 1992]: on an open
    /// surface the outside is a guess
    #[default]
    SpanningTree,
}

/// Summary of a surface reconstruction from the points of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CloudSummary {
    /// points of the file
    pub points: usize,
    /// left out: a coordinate is not finite or out of range
    pub not_finite: usize,
    /// left out: duplicate of an earlier point
    pub duplicates: usize,
    /// left out: farther than ten spacings from any other points
    pub isolated: usize,
    /// source of the normals
    pub normals: NormalSource,
    /// name of the reconstruction
    pub reconstruction: &'static str,
    /// cell of the reconstruction: smaller detail is lost
    pub resolution_mm: f64,
    /// median distance of neighbouring points
    pub spacing_mm: f64,
    /// median distance of the points from a plane through their neighbours
    pub noise_mm: f64,
    /// standard deviation of the surface from smooth areas of the part; edges are rounded by up to
    /// half a cell
    pub error_mm: f64,
    /// faces of the surface
    pub faces: usize,
    /// faces cut away for lack of nearby points
    pub cut_faces: usize,
}

impl fmt::Display for CloudSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            points,
            not_finite,
            duplicates,
            isolated,
            reconstruction,
            faces,
            ..
        } = self;
        write!(f, "{points} points")?;
        if not_finite + duplicates + isolated > 0 {
            write!(
                f,
                " ({not_finite} not finite, {duplicates} at the place of another and {isolated} isolated left out)"
            )?;
        }
        let normals = match self.normals {
            NormalSource::File => "normals of the file",
            NormalSource::Scanner => "estimated normals turned to the scanner",
            NormalSource::SpanningTree => "estimated normals turned from point to point",
        };
        write!(
            f,
            ", a surface of {faces} faces made through them by {reconstruction}, resolution {:.2} mm, points {:.2} mm apart with {:.2} mm \
             noise: {:.3} mm of error to expect where it is smooth, half the resolution at edges; {normals}",
            self.resolution_mm, self.spacing_mm, self.noise_mm, self.error_mm
        )
    }
}
