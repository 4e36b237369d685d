//! Annotations of the panels: legend, colour scale, histogram, length, names of places.

use std::cmp::Ordering;

use nalgebra::Point3;

use super::camera::Camera;
use super::canvas::{NOTE, Picture, TEXT};
use super::raster::{PictureFrame, PicturePanel};
use crate::compare::colour::{ColourScale, Rgb};
use crate::compare::comparison::round_up;
use crate::compare::summary::Histogram;

/// Annotation beside a place of the part, in every panel.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureLabel {
    /// m, in the frame of the meshes
    pub place: Point3<f64>,
    /// Latin-1
    pub text: String,
}

/// Around the picture, pixels.
pub(super) const MARGIN: i32 = 36;
pub(super) const GAP: i32 = 28;
pub(super) const PAPER: Rgb = [255, 255, 255];
pub(super) const INK: Rgb = [32, 36, 44];
pub(super) const SOFT_INK: Rgb = [92, 98, 110];
/// The colour bar, pixels.
pub(super) const BAR: [i32; 2] = [640, 24];
/// Height of the histogram above it, pixels.
pub(super) const HISTOGRAM: i32 = 96;

/// Horizontal position of the colour bar in the picture, pixels.
struct ColourBar {
    left: i32,
    length: i32,
}

impl ColourBar {
    fn of(picture: &Picture) -> Self {
        let width = picture.size[0] as i32;
        let length = BAR[0].min(width * 2 / 5);
        Self {
            left: (width - length) / 2,
            length,
        }
    }
}

/// Colours and their meaning in one line.
pub(super) fn draw_legend(picture: &mut Picture, top: i32, legend: &[(Rgb, &str)]) {
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

/// The colour bar in the middle, its unit above, ticks below, and marks of the tolerance.
///
/// - `tops`: of the line above, and of the bar.
pub(super) fn draw_scale(
    picture: &mut Picture,
    tops: [i32; 2],
    colours: &ColourScale,
    label: &str,
) {
    let [top, bar] = tops;
    let width = picture.size[0] as i32;
    let ColourBar { left, length } = ColourBar::of(picture);
    picture.write(
        [(width - NOTE.width(label)) / 2, top],
        NOTE,
        SOFT_INK,
        label,
    );
    picture.fill([left - 1, bar - 1], [length + 2, BAR[1] + 2], SOFT_INK);
    for x in 0..length {
        let at = 2.0 * (f64::from(x) + 0.5) / f64::from(length) - 1.0;
        picture.fill(
            [left + x, bar],
            [1, BAR[1]],
            colours.colour(at * colours.range),
        );
    }
    for tick in -2..=2 {
        let x = left + (length - 1) * (tick + 2) / 4;
        picture.fill([x, bar + BAR[1]], [1, 7], INK);
        let text = signed_mm(colours.range * f64::from(tick) / 2.0, colours.range);
        picture.write(
            [x - TEXT.width(&text) / 2, bar + BAR[1] + 10],
            TEXT,
            INK,
            &text,
        );
    }
    let Some(tolerance) = colours.tolerance else {
        return;
    };
    let half = (tolerance / colours.range).min(1.0) * f64::from(length) / 2.0;
    for side in [-half, half] {
        let x = left + length / 2 + side.round() as i32;
        picture.fill([x - 1, bar - 3], [2, BAR[1] + 6], INK);
    }
    let text = format!(
        "tolerance ±{} mm",
        signed_mm(tolerance, tolerance).trim_start_matches('+')
    );
    picture.write([left + length + 24, bar], NOTE, INK, &text);
}

/// Share of the surface in each bin of deviations: bars for the last panel, a line for the others.
/// The height is the root of the share, so that rare values are visible.
pub(super) fn draw_histograms(
    picture: &mut Picture,
    bar: i32,
    panels: &[PicturePanel<'_>],
    colours: &ColourScale,
) {
    let ColourBar { left, length } = ColourBar::of(picture);
    let shares = |histogram: &Histogram| -> Vec<f64> {
        let all = histogram.below + histogram.above + histogram.counts.iter().sum::<usize>();
        histogram
            .counts
            .iter()
            .map(|&count| (count as f64 / all.max(1) as f64).sqrt())
            .collect()
    };
    let rows: Vec<(bool, Vec<f64>)> = panels
        .iter()
        .enumerate()
        .filter_map(|(at, panel)| Some((at + 1 == panels.len(), shares(panel.histogram?))))
        .collect();
    let highest = rows
        .iter()
        .flat_map(|(_, row)| row)
        .fold(f64::MIN_POSITIVE, |most, &share| most.max(share));
    for (is_last, row) in &rows {
        let bins = row.len().max(1) as i32;
        let mut former = bar - 4;
        for (bin, share) in (0..).zip(row) {
            let [from, to] = [bin, bin + 1].map(|edge| left + length * edge / bins);
            let height = (share / highest * f64::from(HISTOGRAM - 16)).round() as i32;
            let middle = (2.0 * (f64::from(bin) + 0.5) / f64::from(bins) - 1.0) * colours.range;
            let top = bar - 4 - height;
            if *is_last {
                picture.fill([from, top], [to - from, height], SOFT_INK);
                picture.fill(
                    [from + 1, top + 1],
                    [to - from - 2, height - 1],
                    colours.colour(middle),
                );
            } else {
                picture.fill([from, former.min(top)], [2, (former - top).abs() + 2], INK);
                picture.fill([from, top], [to - from, 2], INK);
                former = top;
            }
        }
    }
    let Some((_, last)) = rows.last() else { return };
    if last.iter().any(|share| *share > 0.0) {
        let lines = if rows.len() > 1 {
            &["share of the surface", "(root scale)", "line: before"][..]
        } else {
            &["share of the surface", "(root scale)"]
        };
        for (line, text) in (0..).zip(lines) {
            picture.write(
                [
                    left + length + 24,
                    bar - HISTOGRAM + 8 + line * (NOTE.height() + 4),
                ],
                NOTE,
                SOFT_INK,
                text,
            );
        }
    }
}

/// Names of places with a line to each. A name keeps clear of the places and of earlier names as
/// far as there is room.
pub(super) fn draw_labels(
    picture: &mut Picture,
    labels: &[PictureLabel],
    camera: &Camera,
    frame: &PictureFrame,
) {
    /// Candidate directions of a name: right and down, in heights of a letter.
    const AROUND: [[i32; 2]; 8] = [
        [2, -3],
        [-2, -3],
        [2, 2],
        [-2, 2],
        [3, -5],
        [-3, -5],
        [3, 4],
        [-3, 4],
    ];
    let [width, height] = picture.size.map(|side| side as i32);
    let at = |label: &PictureLabel| {
        frame
            .pixel(&camera.project(&label.place).xy())
            .map(|side| side.round() as i32)
    };
    let mut taken: Vec<[i32; 4]> = labels
        .iter()
        .map(at)
        .map(|[x, y]| [x - 5, y - 5, x + 5, y + 5])
        .collect();
    for label in labels {
        let [x, y] = at(label);
        let size = [NOTE.width(&label.text), NOTE.height()];
        let box_at = |[right, down]: [i32; 2]| {
            let left = if right > 0 {
                x + right * size[1]
            } else {
                x + right * size[1] - size[0]
            };
            let left = left.clamp(6, (width - size[0] - 6).max(6));
            let top = (y + down * size[1]).clamp(4, (height - size[1] - 4).max(4));
            [left, top, left + size[0], top + size[1]]
        };
        let is_free = |b: &[i32; 4]| {
            let apart = |a: &[i32; 4]| {
                a[0] > b[2] + 8 || b[0] > a[2] + 8 || a[1] > b[3] + 4 || b[1] > a[3] + 4
            };
            taken.iter().all(apart)
        };
        let chosen = AROUND
            .into_iter()
            .map(box_at)
            .find(is_free)
            .unwrap_or_else(|| box_at(AROUND[0]));
        let nearest = [x.clamp(chosen[0], chosen[2]), y.clamp(chosen[1], chosen[3])];
        picture.line([x, y], nearest, INK);
        picture.disc([x, y], 5, PAPER);
        picture.disc([x, y], 3, INK);
        picture.write_on([chosen[0], chosen[1]], NOTE, [INK, PAPER], &label.text);
        taken.push(chosen);
    }
}

/// A signed length in mm, with the number of digits that half of `range` needs.
fn signed_mm(length: f64, range: f64) -> String {
    let digits = (2.0 - (range * 1e3).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{:.digits$}", (length * 1e3).abs());
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    let sign = match length.partial_cmp(&0.0) {
        Some(Ordering::Less) => "-",
        Some(Ordering::Greater) => "+",
        _ => "",
    };
    format!("{sign}{text}")
}

/// A bar of round length below the first panel.
pub(super) fn draw_length(picture: &mut Picture, top: i32, frame: &PictureFrame) {
    let length = round_up(f64::from(frame.size[0]) / frame.scale * 0.12);
    let pixels = (length * frame.scale).round() as i32;
    picture.fill([MARGIN, top + BAR[1] - 4], [pixels, 4], INK);
    for x in [MARGIN, MARGIN + pixels - 2] {
        picture.fill([x, top + BAR[1] - 12], [2, 12], INK);
    }
    let text = format!("{} mm", (length * 1e6).round() / 1e3);
    picture.write([MARGIN, top + BAR[1] + 10], TEXT, INK, &text);
}
