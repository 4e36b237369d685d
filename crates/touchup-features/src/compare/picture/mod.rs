//! A picture of a mesh in the colours of its deviations: before beside after, in the same scale.

mod annotations;
mod camera;
mod canvas;
mod raster;

use nalgebra::{Point3, Vector2, Vector3};

use super::colour::{ColourScale, Rgb, colour_of_class};
use super::disagreement::Class;
pub use annotations::PictureLabel;
use annotations::{
    BAR, GAP, HISTOGRAM, INK, MARGIN, PAPER, SOFT_INK, draw_histograms, draw_labels, draw_legend,
    draw_length, draw_scale,
};
use camera::Camera;
pub use canvas::Picture;
use canvas::{Font, NOTE, TEXT, TITLE};
pub use raster::PicturePanel;
use raster::{PictureFrame, draw};
use touchup_geometry::mesh::VertexId;

/// Settings of a picture: title, scale, view, legend.
#[derive(Clone, Debug)]
pub struct PictureParams<'a> {
    /// first line; Latin-1
    pub title: &'a str,
    /// second line: date, alignment; Latin-1
    pub caption: &'a str,
    /// of the whole picture, pixels, 400 to 8000. Default 1600.
    pub width: u32,
    /// ends of the colour scale, m, more than 0. Default 1 mm.
    pub range: f64,
    /// maximum deviation with the colour of 0, marked on the scale, m
    pub tolerance: Option<f64>,
    /// direction of the viewpoint, with z upwards; default: the side of most weight, askance
    pub from: Option<Vector3<f64>>,
    /// weight of each vertex of the last panel, by slot; without: by its deviation
    pub weights: Option<&'a [f64]>,
    /// colours and their meaning, Latin-1: replaces the bar of deviations for painted panels
    pub legend: &'a [(Rgb, &'a str)],
    /// names of places
    pub labels: &'a [PictureLabel],
}

impl Default for PictureParams<'_> {
    fn default() -> Self {
        Self {
            title: "",
            caption: "",
            width: 1600,
            range: 1e-3,
            tolerance: None,
            from: None,
            weights: None,
            legend: &[],
            labels: &[],
        }
    }
}

const WIDTHS: [u32; 2] = [400, 8000];
/// Margin of a panel around the part, as a share of its sides.
const AIR: f64 = 0.05;
/// Minimum height of a panel over its width.
const FLATTEST: f64 = 0.45;
/// Maximum height of a picture over its width, for a fit on a screen.
const HIGHEST: f64 = 0.62;
/// Titles of the colour bar.
const OF_TRUTH: &str = "deviation, mm:  - too little   + too much material";
const OF_TOUCHES: &str = "touch - scan, mm:  - inside of the scan   + outside";

/// Rows of a picture, pixels.
struct PictureRows {
    /// titles of the panels
    titles: i32,
    panels: i32,
    notes: i32,
    /// meaning of the colours
    legend: i32,
    bar: i32,
    height: i32,
}

impl PictureRows {
    fn of(panels: &[PicturePanel<'_>], params: &PictureParams<'_>, panel_height: i32) -> Self {
        let caption = if params.caption.is_empty() {
            0
        } else {
            NOTE.height() + 8
        };
        let titles = MARGIN + TITLE.height() + caption + GAP / 2;
        let top = titles + TEXT.height() + 8;
        let notes = top + panel_height + 10;
        let legend = notes + NOTE.height() + GAP;
        let of_classes = if has_classes(panels) {
            NOTE.height() + GAP
        } else {
            0
        };
        let has_scale = params.legend.is_empty();
        let histogram = if has_scale && panels.iter().any(|panel| panel.histogram.is_some()) {
            HISTOGRAM
        } else {
            0
        };
        let bar = legend + of_classes + NOTE.height() + 8 + histogram;
        Self {
            titles,
            panels: top,
            notes,
            legend,
            bar,
            height: bar + BAR[1] + 10 + TEXT.height() + MARGIN,
        }
    }
}

fn has_classes(panels: &[PicturePanel<'_>]) -> bool {
    panels.iter().any(|panel| panel.classes.is_some())
}

/// Draws the panels side by side, in one scale and one view, with title, colour bar and length.
pub fn draw_picture(panels: &[PicturePanel<'_>], params: &PictureParams<'_>) -> Picture {
    let width = params.width.clamp(WIDTHS[0], WIDTHS[1]) as i32;
    let count = panels.len().max(1) as i32;
    let panel_width = (width - 2 * MARGIN - (count - 1) * GAP) / count;
    let camera = camera_for(panels, params);
    let frame = frame_for(panels, &camera, panel_width);
    let rows = PictureRows::of(panels, params, frame.size[1] as i32);
    let mut picture = Picture::blank([width, rows.height].map(|side| side as u32), PAPER);
    picture.write(
        [MARGIN, MARGIN],
        TITLE,
        INK,
        &fitted(params.title, TITLE, width - 2 * MARGIN),
    );
    let caption = fitted(params.caption, NOTE, width - 2 * MARGIN);
    picture.write(
        [MARGIN, MARGIN + TITLE.height() + 8],
        NOTE,
        SOFT_INK,
        &caption,
    );
    let colours = ColourScale {
        range: params.range,
        tolerance: params.tolerance,
    };
    for (panel, left) in panels
        .iter()
        .zip((0..).map(|i| MARGIN + i * (panel_width + GAP)))
    {
        let title = fitted(panel.title, TEXT, panel_width);
        picture.write([left, rows.titles], TEXT, INK, &title);
        let mut drawing = draw(panel, &camera, &frame, &colours);
        draw_labels(&mut drawing, params.labels, &camera, &frame);
        picture.paste([left, rows.panels], &drawing);
        let note = fitted(panel.note, NOTE, panel_width);
        picture.write([left, rows.notes], NOTE, SOFT_INK, &note);
    }
    draw_meaning(&mut picture, &rows, panels, params, &colours);
    draw_length(&mut picture, rows.bar, &frame);
    picture
}

/// Draws the meaning of the colours: classes, and colour bar or the given legend.
fn draw_meaning(
    picture: &mut Picture,
    rows: &PictureRows,
    panels: &[PicturePanel<'_>],
    params: &PictureParams<'_>,
    colours: &ColourScale,
) {
    let mut foot = rows.legend;
    let mut scale = OF_TRUTH;
    if has_classes(panels) {
        let classes = Class::ALL.map(|class| (colour_of_class(class), class.name()));
        draw_legend(picture, foot, &classes);
        foot += NOTE.height() + GAP;
        scale = OF_TOUCHES;
    }
    if params.legend.is_empty() {
        draw_scale(picture, [foot, rows.bar], colours, scale);
        draw_histograms(picture, rows.bar, panels, colours);
    } else {
        draw_legend(picture, foot, params.legend);
    }
}

/// A bare picture of a mesh, with the pixels of some places.
#[derive(Clone, Debug, PartialEq)]
pub struct PartView {
    /// the mesh, with air around it
    pub picture: Picture,
    /// of each place, pixels to the right and downwards
    pub places: Vec<[f64; 2]>,
}

/// Draws a bare mesh, for annotation by the caller.
///
/// - `places`: m, in the frame of the mesh.
pub fn draw_part(
    panel: &PicturePanel<'_>,
    params: &PictureParams<'_>,
    places: &[Point3<f64>],
) -> PartView {
    let panels = [*panel];
    let camera = camera_for(&panels, params);
    let frame = frame_for(
        &panels,
        &camera,
        params.width.clamp(WIDTHS[0], WIDTHS[1]) as i32,
    );
    let colours = ColourScale {
        range: params.range,
        tolerance: params.tolerance,
    };
    let picture = draw(panel, &camera, &frame, &colours);
    PartView {
        picture,
        places: places
            .iter()
            .map(|place| frame.pixel(&camera.project(place).xy()))
            .collect(),
    }
}

fn camera_for(panels: &[PicturePanel<'_>], params: &PictureParams<'_>) -> Camera {
    match (&params.from, panels.last()) {
        (Some(from), _) => Camera::new(from, &Vector3::z()),
        (None, Some(panel)) => {
            // large deviations weigh more, up to the range
            let weight = |v: VertexId| match params.weights {
                Some(weights) => weights.get(v.0 as usize).copied().unwrap_or(0.0),
                None => panel
                    .deviations
                    .get(v.0 as usize)
                    .map_or(0.0, |d| d.abs().min(params.range)),
            };
            Camera::towards(panel.mesh, weight)
        }
        (None, None) => Camera::new(&Vector3::z(), &Vector3::y()),
    }
}

/// The frame around all panels.
fn frame_for(panels: &[PicturePanel<'_>], camera: &Camera, width: i32) -> PictureFrame {
    let [lo, hi] = camera.bounds(panels.iter().map(|panel| panel.mesh));
    let sides = (hi - lo).map(|side| {
        if side.is_finite() {
            side.max(f64::MIN_POSITIVE)
        } else {
            1.0
        }
    });
    let aspect = (sides.y / sides.x).clamp(FLATTEST, (HIGHEST * panels.len() as f64).max(FLATTEST));
    let size = [f64::from(width), (f64::from(width) * aspect).round()];
    let scale = (1.0 - 2.0 * AIR) * (size[0] / sides.x).min(size[1] / sides.y);
    let middle = if panels.is_empty() {
        Vector2::zeros()
    } else {
        (lo + hi) / 2.0
    };
    PictureFrame {
        middle,
        scale,
        size: size.map(|side| side as u32),
    }
}

/// The text, cut to `width` pixels.
fn fitted(text: &str, font: Font, width: i32) -> String {
    let most = (width / font.width(" ").max(1)).max(0) as usize;
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars()
        .take(most.saturating_sub(3))
        .chain("...".chars())
        .collect()
}
