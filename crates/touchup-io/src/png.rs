//! Pictures as PNG files.

use std::io::{self, Write};
use std::path::Path;

use super::atomic::write_atomically;

/// Writes a picture of 8 bits for each of red, green and blue; the file appears whole or not at
/// all.
///
/// - `size`: width and height, pixels.
/// - `pixels`: row by row from the top, three bytes each.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] if the number of `pixels` differs from `size`; any disk error.
pub fn write_png(path: &Path, size: [u32; 2], pixels: &[u8]) -> io::Result<()> {
    write_atomically(path, |out| encode(out, size, pixels))
}

/// The bytes of such a file, for embedding in a page.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] if the number of `pixels` differs from `size`.
pub fn png_bytes(size: [u32; 2], pixels: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    encode(&mut bytes, size, pixels)?;
    Ok(bytes)
}

fn encode(out: impl Write, size: [u32; 2], pixels: &[u8]) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io_error)?;
    writer.write_image_data(pixels).map_err(io_error)?;
    writer.finish().map_err(io_error)
}

fn io_error(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        error => io::Error::new(io::ErrorKind::InvalidInput, error),
    }
}
