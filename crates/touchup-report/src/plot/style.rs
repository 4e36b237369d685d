//! How one series differs from another: by colour, and without it by mark and dashes.

use std::collections::{BTreeMap, BTreeSet};

use super::writer::Svg;

/// Colours that colour-blind readers distinguish too (Okabe and Ito), dark enough on white.
const COLOURS: [&str; 8] = [
    "#0072b2", "#d55e00", "#009e73", "#b5559b", "#3a9bd9", "#b87d00", "#000000", "#7a7a7a",
];
/// Of the lines between marks.
const DASHES: [&str; 4] = ["", "7 3", "2 3", "9 3 2 3"];
/// Of lines without marks.
const MODEL_DASHES: [&str; 4] = ["4 4", "10 4", "1 3", "10 3 1 3"];
/// Half the size of a mark, pixels.
const HALF: f64 = 4.5;

/// Which look each series has, by its name, in all figures.
#[derive(Debug)]
pub struct Looks(BTreeMap<String, usize>);

impl Looks {
    /// Names keep the look of their first figure; a new one gets the first look that none beside it
    /// has, in any figure.
    ///
    /// - `figures`: the names in each.
    pub fn of<'a>(figures: impl Iterator<Item = Vec<&'a str>>) -> Self {
        let figures: Vec<Vec<&str>> = figures.collect();
        let mut looks = BTreeMap::new();
        for name in figures.iter().flatten() {
            if looks.contains_key(*name) {
                continue;
            }
            let beside = figures
                .iter()
                .filter(|names| names.contains(name))
                .flatten();
            let taken: BTreeSet<usize> = beside
                .filter_map(|other| looks.get(*other).copied())
                .collect();
            let free = (0..).find(|look| !taken.contains(look)).unwrap_or_default();
            looks.insert((*name).to_owned(), free);
        }
        Self(looks)
    }

    /// That of a series in one of the figures.
    pub(super) fn look(&self, name: &str) -> Look {
        Look(self.0.get(name).copied().unwrap_or_default())
    }
}

/// The look of a series, the same in frame and legend.
#[derive(Clone, Copy)]
pub(super) struct Look(usize);

impl Look {
    pub fn colour(self) -> &'static str {
        COLOURS[self.0 % COLOURS.len()]
    }

    /// Attributes of the line that joins marks.
    pub fn line(self) -> String {
        let dashes = DASHES[(self.0 / 2) % DASHES.len()];
        format!(
            "stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"{dashes}\"",
            self.colour()
        )
        .replace(" stroke-dasharray=\"\"", "")
    }

    /// Attributes of a line without marks.
    pub fn dashed(self) -> String {
        let dashes = MODEL_DASHES[self.0 % MODEL_DASHES.len()];
        format!(
            "stroke=\"{}\" stroke-width=\"1.2\" stroke-dasharray=\"{dashes}\"",
            self.colour()
        )
    }

    /// Attributes of an error bar.
    pub fn bar(self) -> String {
        format!(
            "stroke=\"{}\" stroke-width=\"1\" stroke-opacity=\"0.7\"",
            self.colour()
        )
    }

    /// Its mark: one of eight shapes.
    pub fn mark(self, svg: &mut Svg, [x, y]: [f64; 2]) {
        let colour = self.colour();
        let filled = format!("fill=\"{colour}\" stroke=\"#fff\" stroke-width=\"0.6\"");
        let hollow = format!("fill=\"#fff\" stroke=\"{colour}\" stroke-width=\"1.6\"");
        let stroke = format!("stroke=\"{colour}\" stroke-width=\"1.8\"");
        let shape = |corners: &[[f64; 2]]| {
            corners
                .iter()
                .map(|[dx, dy]| [x + HALF * dx, y + HALF * dy])
                .collect::<Vec<_>>()
        };
        let square = shape(&[[-0.85, -0.85], [0.85, -0.85], [0.85, 0.85], [-0.85, 0.85]]);
        let diamond = shape(&[[0.0, -1.2], [1.2, 0.0], [0.0, 1.2], [-1.2, 0.0]]);
        // beyond eight, where colours come again, other shapes go with them
        match (self.0 + self.0 / 8) % 8 {
            0 => svg.circle([x, y], HALF * 0.95, &filled),
            1 => svg.polygon(&square, &filled),
            2 => svg.polygon(&shape(&[[0.0, -1.1], [1.05, 0.8], [-1.05, 0.8]]), &filled),
            3 => svg.polygon(&diamond, &filled),
            4 => svg.circle([x, y], HALF * 0.85, &hollow),
            5 => svg.polygon(&square, &hollow),
            6 => {
                let ends = shape(&[[-0.8, -0.8], [0.8, 0.8], [-0.8, 0.8], [0.8, -0.8]]);
                ends.chunks(2)
                    .for_each(|ends| svg.line(ends[0], ends[1], &stroke));
            }
            _ => svg.polygon(&diamond, &hollow),
        }
    }
}

/// Width of a text, pixels, a little more than it takes.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    0.58 * size * text.chars().count() as f64
}
