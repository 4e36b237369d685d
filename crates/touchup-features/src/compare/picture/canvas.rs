//! Pixels, boxes and letters.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::compare::colour::Rgb;

/// A picture of 8 bits for each of red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// width and height, pixels
    pub size: [u32; 2],
    /// row by row from the top, three bytes each
    pub pixels: Vec<u8>,
}

/// Size and weight of letters.
#[derive(Clone, Copy)]
pub(super) struct Font {
    weight: FontWeight,
    height: RasterHeight,
}

pub(super) const TITLE: Font = Font {
    weight: FontWeight::Bold,
    height: RasterHeight::Size32,
};
pub(super) const TEXT: Font = Font {
    weight: FontWeight::Regular,
    height: RasterHeight::Size24,
};
pub(super) const NOTE: Font = Font {
    weight: FontWeight::Regular,
    height: RasterHeight::Size20,
};

impl Font {
    /// Height of a line, pixels.
    pub(crate) fn height(self) -> i32 {
        self.height.val() as i32
    }

    /// Width of a text in one line, pixels.
    pub(crate) fn width(self, text: &str) -> i32 {
        (get_raster_width(self.weight, self.height) * text.chars().count()) as i32
    }
}

impl Picture {
    /// A picture of one colour.
    pub(crate) fn blank(size: [u32; 2], colour: Rgb) -> Self {
        Self {
            size,
            pixels: colour.repeat(size[0] as usize * size[1] as usize),
        }
    }

    /// Mixes `share` (0 to 1) of a colour into a pixel; has no effect outside of the picture.
    pub(crate) fn mix(&mut self, x: i32, y: i32, colour: Rgb, share: f64) {
        let [width, height] = self.size.map(|side| side as i32);
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let at = 3 * (y as usize * width as usize + x as usize);
        for (old, new) in self.pixels[at..at + 3].iter_mut().zip(colour) {
            *old = (f64::from(*old) + (f64::from(new) - f64::from(*old)) * share).round() as u8;
        }
    }

    /// Fills a box of width and height from its upper left corner.
    pub(crate) fn fill(&mut self, [x, y]: [i32; 2], [width, height]: [i32; 2], colour: Rgb) {
        for row in y..y + height {
            (x..x + width).for_each(|column| self.mix(column, row, colour, 1.0));
        }
    }

    /// Writes one line from its upper left corner; letters missing from the font become question
    /// marks.
    pub(super) fn write(&mut self, [x, y]: [i32; 2], font: Font, colour: Rgb, text: &str) {
        let advance = font.width(" ");
        for (letter, left) in text.chars().zip((0..).map(|i| x + i * advance)) {
            let glyph = get_raster(letter, font.weight, font.height);
            let Some(glyph) = glyph.or_else(|| get_raster('?', font.weight, font.height)) else {
                continue;
            };
            for (row, pixels) in (y..).zip(glyph.rows()) {
                for (column, &grey) in (left..).zip(pixels) {
                    self.mix(column, row, colour, f64::from(grey) / 255.0);
                }
            }
        }
    }

    /// Writes one line on a box of `paper` a little larger than the text.
    pub(super) fn write_on(
        &mut self,
        [x, y]: [i32; 2],
        font: Font,
        [ink, paper]: [Rgb; 2],
        text: &str,
    ) {
        self.fill(
            [x - 4, y - 1],
            [font.width(text) + 8, font.height() + 2],
            paper,
        );
        self.write([x, y], font, ink, text);
    }

    /// A line of two pixels' width.
    pub(super) fn line(&mut self, from: [i32; 2], to: [i32; 2], colour: Rgb) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]].map(f64::from);
        let steps = dx.abs().max(dy.abs()).max(1.0);
        for step in 0..=steps as i32 {
            let share = f64::from(step) / steps;
            let place = [
                from[0] + (dx * share).round() as i32,
                from[1] + (dy * share).round() as i32,
            ];
            self.fill(place, [2, 2], colour);
        }
    }

    /// A disc of a radius in pixels around a middle.
    pub(super) fn disc(&mut self, [x, y]: [i32; 2], radius: i32, colour: Rgb) {
        for dy in -radius..=radius {
            let half = f64::from(radius * radius - dy * dy).sqrt().round() as i32;
            self.fill([x - half, y + dy], [2 * half + 1, 1], colour);
        }
    }

    /// Lays another picture over this one.
    pub(crate) fn paste(&mut self, [x, y]: [i32; 2], other: &Self) {
        let width = other.size[0].max(1) as usize;
        for (row, pixels) in (y..).zip(other.pixels.chunks(3 * width)) {
            for (column, pixel) in (x..).zip(pixels.as_chunks::<3>().0) {
                self.mix(column, row, *pixel, 1.0);
            }
        }
    }
}
