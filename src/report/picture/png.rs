//! A picture in pixels. Its letters come from fonts that are part of the program: a board has none.

use std::sync::{Arc, LazyLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

/// DejaVu Sans, reduced to the letters of European languages, arrows and dots; see
/// `fonts/README.md`.
const FONTS: [&[u8]; 2] =
    [include_bytes!("fonts/DejaVuSans.ttf"), include_bytes!("fonts/DejaVuSans-Bold.ttf")];

/// Pixels for each unit of the drawing: sharp on screens of high resolution and in print.
const SCALE: f32 = 2.0;

static LETTERS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut database = fontdb::Database::new();
    for font in FONTS {
        database.load_font_data(font.to_vec());
    }
    // Whatever a style asks for, this is what there is.
    database.set_sans_serif_family("DejaVu Sans");
    database.set_serif_family("DejaVu Sans");
    Arc::new(database)
});

/// Draws an SVG as PNG; the reason where that is not possible.
pub(in crate::report) fn png(svg: &str) -> Result<Vec<u8>, String> {
    let options = Options { fontdb: Arc::clone(&LETTERS), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let size = tree.size().to_int_size().scale_by(SCALE).ok_or("it has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("it is too large")?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(content: &str) -> Pixmap {
        let svg = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='100' height='20'>\
             <rect width='100' height='20' fill='#fff'/>{content}</svg>"
        );
        Pixmap::decode_png(&png(&svg).unwrap()).unwrap()
    }

    fn dark(pixels: &Pixmap) -> usize {
        pixels.pixels().iter().filter(|pixel| pixel.red() < 128).count()
    }

    #[test]
    fn letters_are_drawn_with_the_fonts_in_the_program() {
        let text = |style: &str| {
            dark(&drawn(&format!(
                "<text y='15' style=\"font:13px 'No Such Font';{style}\">S1 é →</text>"
            )))
        };
        let (regular, bold) = (text(""), text("font-weight:600"));
        assert!(regular > 100, "{regular} dark pixels");
        assert!(bold > regular + regular / 10, "{bold} against {regular}");
        assert_eq!(dark(&drawn("")), 0);
    }

    #[test]
    fn what_is_no_picture_is_an_error() {
        assert!(png("<html/>").is_err());
    }
}
