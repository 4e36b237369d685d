//! Looks of series: distinct by colour, and without colour by mark and dashes.

use std::collections::{BTreeMap, BTreeSet};

use maud::{Markup, html};

use super::element::px;
use crate::figure::{Drawing, Figure, LineStroke};

/// Colours that colour-blind readers distinguish too (Okabe and Ito), dark enough on white.
const COLOURS: [&str; 8] = [
    "#0072b2", "#d55e00", "#009e73", "#b5559b", "#3a9bd9", "#b87d00", "#000000", "#7a7a7a",
];
/// Dashes of lines between marks; the first is solid.
const DASHES: [&str; 4] = ["", "7 3", "2 3", "9 3 2 3"];
/// Dashes of lines without marks.
const MODEL_DASHES: [&str; 4] = ["4 4", "10 4", "1 3", "10 3 1 3"];
/// Outlines of the marks around their middle.
const MARKS: [&str; 8] = [
    "M-4.3 0a4.3 4.3 0 1 0 8.6 0a4.3 4.3 0 1 0 -8.6 0Z",
    "M-3.8 -3.8h7.6v7.6h-7.6Z",
    "M0 -5L4.7 3.6H-4.7Z",
    "M0 -5.4L5.4 0L0 5.4L-5.4 0Z",
    "M-3.8 0a3.8 3.8 0 1 0 7.6 0a3.8 3.8 0 1 0 -7.6 0Z",
    "M-3.8 -3.8h7.6v7.6h-7.6Z",
    "M-3.6 -3.6L3.6 3.6M-3.6 3.6L3.6 -3.6",
    "M0 -5.4L5.4 0L0 5.4L-5.4 0Z",
];
/// The first marks are filled, the others hollow.
const FILLED: usize = 4;

/// The look of each series, by its name, in all figures of a page.
#[derive(Debug, Default)]
pub struct Looks(BTreeMap<String, usize>);

impl Looks {
    /// Names keep the look of their first figure; a new name gets the first look that no neighbour
    /// has in any figure.
    pub fn of<'a>(figures: impl Iterator<Item = &'a Figure>) -> Self {
        let names = |figure: &'a Figure| match &figure.drawing {
            Drawing::Curves(series) => series.iter().map(|one| one.name.as_str()).collect(),
            Drawing::Maps { .. } => Vec::new(),
        };
        let figures: Vec<Vec<&str>> = figures.map(names).collect();
        let mut looks = BTreeMap::new();
        for name in figures.iter().flatten() {
            let beside = figures.iter().filter(|names| names.contains(name));
            let others = beside.flatten().filter_map(|other| looks.get(*other));
            let taken: BTreeSet<usize> = others.copied().collect();
            let free = (0..).find(|look| !taken.contains(look)).unwrap_or_default();
            looks.entry((*name).to_owned()).or_insert(free);
        }
        Self(looks)
    }

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

    /// The line through points; empty for marks alone.
    pub fn line(self, stroke: LineStroke, points: &str) -> Markup {
        let (width, opacity, dashes) = match stroke {
            LineStroke::Joined => (1.6, 1.0, DASHES[(self.0 / 2) % DASHES.len()]),
            LineStroke::Course => (1.2, 0.5, ""),
            LineStroke::Dashed => (1.2, 1.0, MODEL_DASHES[self.0 % MODEL_DASHES.len()]),
            LineStroke::Marks | LineStroke::Dots | LineStroke::Band => return Markup::default(),
        };
        html! {
            polyline points=(points) fill="none" stroke=(self.colour()) stroke-width=(width)
                stroke-opacity=[(opacity < 1.0).then_some(opacity)]
                stroke-dasharray=[Some(dashes).filter(|dashes| !dashes.is_empty())] {}
        }
    }

    /// One of eight marks, or a dot; empty for lines alone.
    pub fn mark(self, stroke: LineStroke, place: [f64; 2]) -> Markup {
        let [x, y] = place.map(px);
        // beyond eight series, repeated colours have other shapes
        let shape = (self.0 + self.0 / COLOURS.len()) % MARKS.len();
        let (colour, is_filled) = (self.colour(), shape < FILLED);
        match stroke {
            LineStroke::Dots => html! {
                circle cx=(x) cy=(y) r="1.9" fill=(colour) fill-opacity="0.75" {}
            },
            LineStroke::Joined | LineStroke::Marks => html! {
                path d=(MARKS[shape]) transform={ "translate(" (x) " " (y) ")" }
                    fill=(if is_filled { colour } else { "#fff" })
                    stroke=(if is_filled { "#fff" } else { colour })
                    stroke-width=(if is_filled { "0.6" } else { "1.7" }) {}
            },
            LineStroke::Course | LineStroke::Dashed | LineStroke::Band => Markup::default(),
        }
    }
}
