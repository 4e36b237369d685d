//! A picture of a mesh in the colours of its deviations: what was before beside what is now, in the same scale.

mod camera;
mod canvas;
mod raster;

use nalgebra::{Vector2, Vector3};

use super::colour::{Rgb, colour_of, colour_of_class};
use super::comparison::round_up;
use super::disagreement::Class;
use crate::mesh::{TriMesh, VertexId};
use camera::Camera;
pub use canvas::Picture;
use canvas::{Font, NOTE, TEXT, TITLE};
use raster::{PictureFrame, draw};

/// A mesh to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct PicturePanel<'a> {
    /// m
    pub mesh: &'a TriMesh,
    /// of each vertex slot, m, + outside
    pub deviations: &'a [f64],
    /// of each vertex slot; drawn in their colours where they are given
    pub classes: Option<&'a [Class]>,
    /// of each vertex slot, instead of all that; what it means is said in the legend
    pub paint: Option<&'a [Rgb]>,
    /// stands above it; ASCII
    pub title: &'a str,
    /// stands below it; ASCII
    pub note: &'a str,
}

/// What is drawn around the panels, and how.
#[derive(Clone, Debug)]
pub struct PictureParams<'a> {
    /// first line; ASCII
    pub title: &'a str,
    /// of the whole picture, pixels, 400 to 8000. Default 1600.
    pub width: u32,
    /// ends of the scale of colours, m, more than 0
    pub range: f64,
    /// from where it is seen, with z upwards; default: the side that most matters, askance
    pub from: Option<Vector3<f64>>,
    /// how much each vertex of the last panel matters, by slot; without: by its deviation
    pub weights: Option<&'a [f64]>,
    /// colours and what they mean, ASCII: instead of the bar of deviations where panels are painted
    pub legend: &'a [(Rgb, &'a str)],
}

const WIDTHS: [u32; 2] = [400, 8000];
const MARGIN: i32 = 36;
const GAP: i32 = 28;
const PAPER: Rgb = [255, 255, 255];
const BACKGROUND: Rgb = [233, 236, 240];
const INK: Rgb = [32, 36, 44];
const SOFT_INK: Rgb = [92, 98, 110];
/// What a panel leaves free around the part, share of its sides.
const AIR: f64 = 0.05;
/// A panel is at least so high over its width.
const FLATTEST: f64 = 0.45;
/// And a picture of one panel or more at most, so that it fits on a screen.
const HIGHEST: f64 = 0.62;
/// What stands above the bar of colours.
const OF_TRUTH: &str = "deviation, mm:  - too little   + too much material";
const OF_TOUCHES: &str = "touch - scan, mm:  - inside of the scan   + outside";
/// The bar of colours, pixels.
const BAR: [i32; 2] = [640, 24];

/// Draws the panels side by side, in one scale and one view, with title, bar of colours and length.
pub fn draw_picture(panels: &[PicturePanel<'_>], params: &PictureParams<'_>) -> Picture {
    let width = params.width.clamp(WIDTHS[0], WIDTHS[1]) as i32;
    let count = panels.len().max(1) as i32;
    let panel_width = (width - 2 * MARGIN - (count - 1) * GAP) / count;
    let camera = camera_for(panels, params);
    let frame = frame_for(panels, &camera, panel_width);
    let panel_height = frame.size[1] as i32;

    let above = MARGIN + TITLE.height() + GAP / 2;
    let foot = above + TEXT.height() + 8 + panel_height + 10 + NOTE.height() + GAP;
    let has_classes = panels.iter().any(|panel| panel.classes.is_some());
    let legend = if has_classes { NOTE.height() + GAP } else { 0 };
    let height = foot + legend + NOTE.height() + 8 + BAR[1] + 10 + TEXT.height() + MARGIN;
    let mut picture = Picture::blank([width, height].map(|side| side as u32), PAPER);
    picture.write([MARGIN, MARGIN], TITLE, INK, &fitted(params.title, TITLE, width - 2 * MARGIN));
    for (panel, left) in panels.iter().zip((0..).map(|i| MARGIN + i * (panel_width + GAP))) {
        let top = above + TEXT.height() + 8;
        picture.write([left, above], TEXT, INK, &fitted(panel.title, TEXT, panel_width));
        picture.paste([left, top], &draw(panel, &camera, &frame, params.range));
        picture.write([left, top + panel_height + 10], NOTE, SOFT_INK, &fitted(panel.note, NOTE, panel_width));
    }
    if has_classes {
        draw_legend(&mut picture, foot, &Class::ALL.map(|class| (colour_of_class(class), class.name())));
    }
    let foot = foot + legend;
    let label = if has_classes { OF_TOUCHES } else { OF_TRUTH };
    if params.legend.is_empty() {
        draw_scale(&mut picture, foot, params.range, label);
    } else {
        draw_legend(&mut picture, foot, params.legend);
    }
    draw_length(&mut picture, foot + NOTE.height() + 8, &frame);
    picture
}

fn camera_for(panels: &[PicturePanel<'_>], params: &PictureParams<'_>) -> Camera {
    match (&params.from, panels.last()) {
        (Some(from), _) => Camera::new(from, &Vector3::z()),
        (None, Some(panel)) => {
            // what is far off matters, but not without end
            let weight = |v: VertexId| match params.weights {
                Some(weights) => weights.get(v.0 as usize).copied().unwrap_or(0.0),
                None => panel.deviations.get(v.0 as usize).map_or(0.0, |d| d.abs().min(params.range)),
            };
            Camera::towards(panel.mesh, weight)
        }
        (None, None) => Camera::new(&Vector3::z(), &Vector3::y()),
    }
}

/// All panels fit into it.
fn frame_for(panels: &[PicturePanel<'_>], camera: &Camera, width: i32) -> PictureFrame {
    let [lo, hi] = camera.bounds(panels.iter().map(|panel| panel.mesh));
    let sides = (hi - lo).map(|side| if side.is_finite() { side.max(f64::MIN_POSITIVE) } else { 1.0 });
    let aspect = (sides.y / sides.x).clamp(FLATTEST, (HIGHEST * panels.len() as f64).max(FLATTEST));
    let size = [f64::from(width), (f64::from(width) * aspect).round()];
    let scale = (1.0 - 2.0 * AIR) * (size[0] / sides.x).min(size[1] / sides.y);
    let middle = if panels.is_empty() { Vector2::zeros() } else { (lo + hi) / 2.0 };
    PictureFrame { middle, scale, size: size.map(|side| side as u32) }
}

/// Colours and what they mean in one line.
fn draw_legend(picture: &mut Picture, top: i32, legend: &[(Rgb, &str)]) {
    let side = NOTE.height();
    let width = picture.size[0] as i32 - 2 * MARGIN;
    let length = |text: &str| side + 8 + NOTE.width(text);
    let all = legend.iter().map(|(_, text)| length(text)).sum::<i32>();
    let gap = ((width - all) / (legend.len() as i32 - 1).max(1)).clamp(8, 8 * GAP);
    let mut left = MARGIN;
    for (colour, text) in legend {
        picture.fill([left, top], [side, side], SOFT_INK);
        picture.fill([left + 1, top + 1], [side - 2, side - 2], *colour);
        picture.write([left + side + 8, top], NOTE, INK, text);
        left += length(text) + gap;
    }
}

/// The bar of colours in the middle, its unit above and ticks below.
fn draw_scale(picture: &mut Picture, top: i32, range: f64, label: &str) {
    let width = picture.size[0] as i32;
    let [length, thickness] = [BAR[0].min(width * 2 / 5), BAR[1]];
    let left = (width - length) / 2;
    let bar = top + NOTE.height() + 8;
    picture.write([(width - NOTE.width(label)) / 2, top], NOTE, SOFT_INK, label);
    picture.fill([left - 1, bar - 1], [length + 2, thickness + 2], SOFT_INK);
    for x in 0..length {
        let at = 2.0 * (f64::from(x) + 0.5) / f64::from(length) - 1.0;
        picture.fill([left + x, bar], [1, thickness], colour_of(at, 1.0));
    }
    for tick in -2..=2 {
        let x = left + (length - 1) * (tick + 2) / 4;
        picture.fill([x, bar + thickness], [1, 7], INK);
        let text = signed_mm(range * f64::from(tick) / 2.0, range);
        picture.write([x - TEXT.width(&text) / 2, bar + thickness + 10], TEXT, INK, &text);
    }
}

/// A length in mm with its sign, with as many digits as the half of `range` needs.
fn signed_mm(length: f64, range: f64) -> String {
    let digits = (2.0 - (range * 1e3).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{:.digits$}", (length * 1e3).abs());
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let sign = if length < 0.0 {
        "-"
    } else if length > 0.0 {
        "+"
    } else {
        ""
    };
    format!("{sign}{text}")
}

/// A bar of round length below the first panel.
fn draw_length(picture: &mut Picture, top: i32, frame: &PictureFrame) {
    let length = round_up(f64::from(frame.size[0]) / frame.scale * 0.12);
    let pixels = (length * frame.scale).round() as i32;
    picture.fill([MARGIN, top + BAR[1] - 4], [pixels, 4], INK);
    for x in [MARGIN, MARGIN + pixels - 2] {
        picture.fill([x, top + BAR[1] - 12], [2, 12], INK);
    }
    let text = format!("{} mm", (length * 1e6).round() / 1e3);
    picture.write([MARGIN, top + BAR[1] + 10], TEXT, INK, &text);
}

/// The text, cut off where it is wider than `width` pixels.
fn fitted(text: &str, font: Font, width: i32) -> String {
    let most = (width / font.width(" ").max(1)).max(0) as usize;
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars().take(most.saturating_sub(3)).chain("...".chars()).collect()
}
