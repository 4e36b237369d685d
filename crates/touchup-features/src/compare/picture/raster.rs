//! Triangles to pixels: a depth buffer, several samples for each pixel, light from over the
//! shoulder.

use nalgebra::{Vector2, Vector3};

use super::camera::Camera;
use super::canvas::Picture;
use crate::compare::Class;
use crate::compare::colour::{ColourScale, Rgb, colour_of_class};
use crate::compare::summary::Histogram;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};
use touchup_geometry::numeric::largest;

/// A mesh to draw.
#[derive(Clone, Copy, Debug)]
pub struct PicturePanel<'a> {
    /// m
    pub mesh: &'a TriMesh,
    /// of each vertex slot, m, + outside
    pub deviations: &'a [f64],
    /// of each vertex slot; their colours replace those of the deviations
    pub classes: Option<&'a [Class]>,
    /// of each vertex slot, instead of both; the legend gives their meaning
    pub paint: Option<&'a [Rgb]>,
    /// of its deviations, drawn over the colour bar: bars for the last panel, a line for the others
    pub histogram: Option<&'a Histogram>,
    /// printed above it; Latin-1
    pub title: &'a str,
    /// printed below it; Latin-1
    pub note: &'a str,
}

impl<'a> PicturePanel<'a> {
    /// A bare mesh.
    pub fn of(mesh: &'a TriMesh) -> Self {
        Self {
            mesh,
            deviations: &[],
            classes: None,
            paint: None,
            histogram: None,
            title: "",
            note: "",
        }
    }
}

/// Colour behind the part.
const BACKGROUND: Rgb = [233, 236, 240];
/// Samples on each axis of a pixel.
const FINE: u32 = 3;
/// Number of precomputed colours of the scale.
const SHADES: usize = 512;
/// Share of ambient light; the remainder comes from the lamp.
const AMBIENT: f64 = 0.55;
/// Direction of the lamp: right, up, towards the viewer.
const LAMP: [f64; 3] = [-0.3, 0.45, 0.85];
/// Share of its colour on the inside of a surface; the remainder is grey.
const INSIDE: f64 = 0.35;
/// Grey of the inside.
const INSIDE_GREY: f64 = 120.0;
/// Share of the light at a silhouette.
const OUTLINE: f64 = 0.45;
/// Minimum step in depth at a silhouette, as a share of the picture's height.
const STEP: f64 = 0.012;

/// Placement of a picture in the plane of the view.
#[derive(Clone, Copy, Debug)]
pub(super) struct PictureFrame {
    /// middle of the picture, m
    pub middle: Vector2<f64>,
    /// pixels for each m
    pub scale: f64,
    /// pixels
    pub size: [u32; 2],
}

impl PictureFrame {
    /// Pixels to the right and downwards of a place in the plane of the view, m.
    pub(crate) fn pixel(&self, place: &Vector2<f64>) -> [f64; 2] {
        let [width, height] = self.size.map(f64::from);
        let off = (place - self.middle) * self.scale;
        [width / 2.0 + off.x, height / 2.0 - off.y]
    }
}

/// Samples of a picture.
struct Samples {
    width: usize,
    height: usize,
    /// towards the viewer, m; −∞ for the background
    depth: Vec<f32>,
    colour: Vec<Rgb>,
}

/// Draws one mesh in the colours of its deviations.
///
/// - `colours`: of deviations.
pub(super) fn draw(
    panel: &PicturePanel<'_>,
    camera: &Camera,
    frame: &PictureFrame,
    colours: &ColourScale,
) -> Picture {
    let [width, height] = frame.size.map(|side| (side * FINE) as usize);
    let mut samples = Samples {
        width,
        height,
        depth: vec![f32::NEG_INFINITY; width * height],
        colour: vec![BACKGROUND; width * height],
    };
    let range = colours.range;
    let shades: Vec<Rgb> = (0..SHADES)
        .map(|i| colours.colour((2.0 * i as f64 / (SHADES - 1) as f64 - 1.0) * range))
        .collect();
    let scale = frame.scale * f64::from(FINE);
    let place = |p: &Vector3<f64>| {
        let [x, y] = frame.pixel(&p.xy()).map(|side| side * f64::from(FINE));
        Vector3::new(x, y, p.z)
    };
    // colour of a vertex; `None` shows deviations
    let paint = |v: VertexId| match (panel.paint, panel.classes) {
        (Some(paint), _) => Some(paint.get(v.0 as usize).copied().unwrap_or(BACKGROUND)),
        (None, Some(classes)) => Some(
            classes
                .get(v.0 as usize)
                .map_or(BACKGROUND, |&class| colour_of_class(class)),
        ),
        (None, None) => None,
    };
    for (face, corners) in panel.mesh.faces() {
        let places = panel
            .mesh
            .triangle(face)
            .map(|p| place(&camera.project(&p)));
        let values = corners.map(|v| {
            panel
                .deviations
                .get(v.0 as usize)
                .map_or(0.0, |d| d / range)
        });
        let (light, paint) = (light_on(panel, camera, face), corners.map(paint));
        samples.fill(&places, |shares| match paint[largest(&shares)] {
            Some(colour) => lit(colour, light),
            None => shade(
                &shades,
                shares.iter().zip(values).map(|(s, v)| s * v).sum(),
                light,
            ),
        });
    }
    samples.silhouette((STEP * height as f64 / scale) as f32);
    samples.averaged(frame.size)
}

/// Share of the light on a face, negative for its inside.
fn light_on(panel: &PicturePanel<'_>, camera: &Camera, face: FaceId) -> f64 {
    let normal = panel.mesh.normal(face);
    let [x, y, z] = LAMP;
    let lamp = (camera.right * x + camera.up * y + camera.out * z).normalize();
    let facing = normal.dot(&camera.out);
    let lit = AMBIENT + (1.0 - AMBIENT) * (normal.dot(&lamp) * facing.signum()).max(0.0);
    lit.min(1.0).copysign(facing)
}

/// - `value`: deviation over the range.
/// - `light`: as of [`light_on`].
fn shade(shades: &[Rgb], value: f64, light: f64) -> Rgb {
    let at = (value.clamp(-1.0, 1.0) + 1.0) / 2.0 * (SHADES - 1) as f64;
    lit(shades[(at.round() as usize).min(SHADES - 1)], light)
}

/// A colour in the light of [`light_on`].
fn lit(colour: Rgb, light: f64) -> Rgb {
    let inside = |c: f64| {
        if light < 0.0 {
            INSIDE_GREY + (c - INSIDE_GREY) * INSIDE
        } else {
            c
        }
    };
    colour.map(|c| (inside(f64::from(c)) * light.abs()).round() as u8)
}

impl Samples {
    /// Colours the visible samples inside a triangle.
    ///
    /// - `places`: corners, samples to the right and downwards, and m towards the viewer.
    /// - `colour`: from the barycentric coordinates.
    fn fill(&mut self, places: &[Vector3<f64>; 3], colour: impl Fn([f64; 3]) -> Rgb) {
        let [a, b, c] = places;
        let double_area = (b - a).xy().perp(&(c - a).xy());
        let (lo, hi) = (a.inf(b).inf(c), a.sup(b).sup(c));
        if double_area == 0.0 || !double_area.is_finite() {
            return;
        }
        let columns = covered(lo.x, hi.x, self.width);
        for y in covered(lo.y, hi.y, self.height) {
            for x in columns.clone() {
                let p = Vector2::new(x as f64 + 0.5, y as f64 + 0.5);
                let share = |s: &Vector3<f64>, e: &Vector3<f64>| {
                    (e - s).xy().perp(&(p - s.xy())) / double_area
                };
                let shares = [share(b, c), share(c, a), share(a, b)];
                if shares.iter().any(|&share| share < 0.0) {
                    continue;
                }
                let depth = (shares[0] * a.z + shares[1] * b.z + shares[2] * c.z) as f32;
                let at = y * self.width + x;
                if depth > self.depth[at] {
                    self.depth[at] = depth;
                    self.colour[at] = colour(shares);
                }
            }
        }
    }

    /// Darkens samples at which the surface ends or falls back by more than `step` (m).
    fn silhouette(&mut self, step: f32) {
        for y in 0..self.height {
            for x in 0..self.width {
                let at = y * self.width + x;
                let beside = [
                    (x > 0).then(|| at - 1),
                    (x + 1 < self.width).then(|| at + 1),
                    (y > 0).then(|| at - self.width),
                    (y + 1 < self.height).then(|| at + self.width),
                ];
                let is_rim = |other: usize| self.depth[at] - self.depth[other] > step;
                if self.depth[at] > f32::NEG_INFINITY && beside.into_iter().flatten().any(is_rim) {
                    self.colour[at] = self.colour[at].map(|c| (f64::from(c) * OUTLINE) as u8);
                }
            }
        }
    }

    /// The mean of the samples of each pixel.
    fn averaged(&self, size: [u32; 2]) -> Picture {
        let fine = FINE as usize;
        let mut pixels = Vec::with_capacity(3 * size[0] as usize * size[1] as usize);
        for y in 0..size[1] as usize {
            for x in 0..size[0] as usize {
                let mut sum = [0u32; 3];
                for row in 0..fine {
                    let from = (y * fine + row) * self.width + x * fine;
                    for colour in &self.colour[from..from + fine] {
                        sum.iter_mut()
                            .zip(colour)
                            .for_each(|(sum, c)| *sum += u32::from(*c));
                    }
                }
                pixels.extend(sum.map(|sum| (sum / (FINE * FINE)) as u8));
            }
        }
        Picture { size, pixels }
    }
}

/// The samples with possible middles between `lo` and `hi`.
fn covered(lo: f64, hi: f64, count: usize) -> std::ops::Range<usize> {
    // casts end at 0 and at the largest number
    (lo - 0.5).ceil().max(0.0) as usize..((hi + 0.5).floor().max(0.0) as usize).min(count)
}
