use super::*;

fn checkered() -> Grid<Cell> {
    let mut map = Grid::filled(Point2::new(-1.25, 0.1), 0.05, 7, 4, Cell::Unknown);
    for (index, cell) in map.cells_mut().iter_mut().enumerate() {
        *cell = [Cell::Occupied, Cell::Free, Cell::Unknown, Cell::Free, Cell::Free][index % 5];
    }
    map
}

#[test]
fn a_map_goes_to_image_and_yaml_and_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    write_map(&dir.path().join("map.v2"), &checkered()).unwrap();
    assert_eq!(read_map(&dir.path().join("map.v2.yaml")).unwrap(), checkered());
    let image = std::fs::read(dir.path().join("map.v2.pgm")).unwrap();
    let pixels = image.strip_prefix(b"P5\n7 4\n255\n").unwrap();
    // The first pixel is the cell of the lowest x and the highest y: column 0 of row 3, index 21.
    assert_eq!((pixels.len(), pixels[0], pixels[21]), (28, 254, 0));
}

#[test]
fn another_tools_yaml_with_negation_comments_and_quotes_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let yaml = dir.path().join("m.yaml");
    std::fs::write(dir.path().join("m.pgm"), b"P5 # made elsewhere\n2 1\n255\n\xff\x00").unwrap();
    std::fs::write(&yaml, "image: \"m.pgm\" # picture\nresolution: 0.1\norigin: [1, -2, 0]\nnegate: 1\n")
        .unwrap();
    let map = read_map(&yaml).unwrap();
    assert_eq!(map.cells(), [Cell::Occupied, Cell::Free]);
    assert_eq!(map.origin(), Point2::new(1.0, -2.0));
}

#[test]
fn a_refused_map_names_file_key_found_and_wanted() {
    let dir = tempfile::tempdir().unwrap();
    let yaml = dir.path().join("m.yaml");
    let good = "image: m.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n";
    std::fs::write(dir.path().join("m.pgm"), b"P5 1 1 255\n\x00").unwrap();
    for (text, wanted) in [
        (good.replace("0.1", "wide"), "`resolution`: found `wide`; wanted a number"),
        (good.replace("0.1", "-1"), "wanted a positive number of meters"),
        (good.replace("0.1", "nan"), "`resolution`: found `nan`"),
        (good.replace("image: m.pgm", ""), "`image`: found nothing"),
        (good.replace("[0, 0, 0]", "[0, 0]"), "`origin`: found `[0, 0]`; wanted [x, y, yaw]"),
        (good.replace("[0, 0, 0]", "[0, 0, 1.57]"), "no rotation"),
        (format!("{good}mode: raw\n"), "`mode`: found `raw`; wanted `trinary`"),
    ] {
        std::fs::write(&yaml, text).unwrap();
        let message = read_map(&yaml).unwrap_err().to_string();
        assert!(message.contains("m.yaml") && message.contains(wanted), "{message}");
    }
    std::fs::write(&yaml, good).unwrap();
    for image in [
        &b""[..],
        b"P6 1 1 255\n\x00",
        b"P5 1",
        b"P5 9 9 255\n\x00",
        b"P5 0 1 255\n",
        b"P5 1 1 65535\n\x00\x00",
    ] {
        std::fs::write(dir.path().join("m.pgm"), image).unwrap();
        let message = read_map(&yaml).unwrap_err().to_string();
        assert!(message.contains("m.pgm: found "), "{message}");
    }
}
