//! A picture and its file.

use crate::failure::Failure;
use std::io::BufWriter;
use std::path::Path;

/// Pixels, row by row from the top.
pub(crate) struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Of as many pixels as width and height say.
    pub(crate) fn new(width: usize, height: usize, pixels: Vec<[u8; 3]>) -> Self {
        debug_assert_eq!(pixels.len(), width * height);
        Picture { width, height, pixels }
    }

    /// Writes it as PNG.
    pub(crate) fn save(&self, path: &Path) -> Result<(), Failure> {
        let file = std::fs::File::create(path).map_err(Failure::file(path, "write"))?;
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .write_header()
            .and_then(|mut writer| {
                writer.write_image_data(self.pixels.as_flattened())?;
                writer.finish()
            })
            .map_err(|error| Failure::file(path, "write")(std::io::Error::other(error)))
    }
}
