use super::*;
use arborloop_base::{Seed, pose2};
use nalgebra::Point2;

/// Draws a grid from rows of characters, the first row the highest: `#` occupied, `.` free, `?` unknown.
fn drawn(resolution_m: f64, rows: &[&str]) -> Grid<Cell> {
    let columns = rows[0].len();
    let mut grid = Grid::filled(Point2::origin(), resolution_m, columns, rows.len(), Cell::Unknown);
    for (row, line) in rows.iter().rev().enumerate() {
        for (column, letter) in line.chars().enumerate() {
            *grid.get_mut(column, row).unwrap() = match letter {
                '#' => Cell::Occupied,
                '.' => Cell::Free,
                _ => Cell::Unknown,
            };
        }
    }
    grid
}

fn within(tolerance_m: f64) -> MapScoreSettings {
    MapScoreSettings { tolerance_m }
}

const POSTS: [&str; 5] = [".......", ".#...#.", ".......", ".#...#.", "......."];

#[test]
fn a_perfect_map_is_right_in_every_way() {
    let truth = drawn(0.1, &POSTS);
    let score = score_map(&truth, &truth, &Pose2::identity(), within(0.0)).unwrap();
    let ratios = [score.accuracy_ratio, score.f1_ratio, score.ppv_ratio, score.tpr_ratio, score.tnr_ratio];
    assert_eq!(ratios, [Some(1.0); 5]);
    assert_eq!(score.mean_map_error_cells, Some(0.0));
    assert_eq!((score.true_positive_cells, score.true_negative_cells), (4, 31));
}

#[test]
fn a_hand_made_map_has_the_numbers_counted_by_hand() {
    let truth = drawn(0.1, &POSTS);
    // One post right, one drawn a cell to the right, one missed, one invented, two cells unknown.
    let map = drawn(0.1, &["......?", ".#....#", ".......", "...#...", "......?"]);
    let score = score_map(&truth, &map, &Pose2::identity(), within(0.0)).unwrap();
    assert_eq!((score.true_positive_cells, score.false_positive_cells), (1, 2));
    assert_eq!((score.false_negative_cells, score.true_negative_cells), (3, 27));
    assert_eq!((score.ppv_ratio, score.tpr_ratio), (Some(1.0 / 3.0), Some(0.25)));
    assert_eq!((score.tnr_ratio, score.accuracy_ratio), (Some(27.0 / 29.0), Some(28.0 / 33.0)));
    assert!((score.f1_ratio.unwrap() - 2.0 / 7.0).abs() < 1e-12);
    // Distances 0, 1 and 2 cells.
    assert!((score.mean_map_error_cells.unwrap() - 1.0).abs() < 1e-12);
    assert!((score.mean_map_error_m.unwrap() - 0.1).abs() < 1e-12);

    let score = score_map(&truth, &map, &Pose2::identity(), within(0.1)).unwrap();
    assert_eq!((score.true_positive_cells, score.false_positive_cells), (2, 1));
    assert_eq!((score.found_surface_cells, score.false_negative_cells), (2, 2));
    assert!((score.mean_map_error_cells.unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn without_tolerance_or_hidden_cells_the_ratios_are_the_textbook_ones() {
    let stream = Seed(9).stream("maps");
    for round in 0..50 {
        let mut draws = stream.at(round);
        // Posts on even cells only: every occupied cell is a surface.
        let mut grid = |share: f64| {
            let mut grid = Grid::filled(Point2::new(-1.0, 2.0), 0.05, 20, 14, Cell::Free);
            for row in (0..14).step_by(2) {
                for column in (0..20).step_by(2) {
                    if draws.chance(share) {
                        *grid.get_mut(column, row).unwrap() = Cell::Occupied;
                    }
                }
            }
            *grid.get_mut(0, 0).unwrap() = Cell::Occupied;
            grid
        };
        let (truth, map) = (grid(0.3), grid(0.3));
        let both =
            |a, b| truth.cells().iter().zip(map.cells()).filter(|(t, m)| **t == a && **m == b).count() as f64;
        let (tp, tn) = (both(Cell::Occupied, Cell::Occupied), both(Cell::Free, Cell::Free));
        let (fp, fn_) = (both(Cell::Free, Cell::Occupied), both(Cell::Occupied, Cell::Free));
        let score = score_map(&truth, &map, &Pose2::identity(), within(0.0)).unwrap();
        for (found, wanted) in [
            (score.ppv_ratio, tp / (tp + fp)),
            (score.tpr_ratio, tp / (tp + fn_)),
            (score.tnr_ratio, tn / (tn + fp)),
            (score.accuracy_ratio, (tp + tn) / (tp + tn + fp + fn_)),
            (score.f1_ratio, 2.0 * tp / (2.0 * tp + fp + fn_)),
        ] {
            assert!((found.unwrap() - wanted).abs() < 1e-12, "round {round}: {score:?}");
        }
    }
}

#[test]
fn the_inside_and_the_far_side_of_a_trunk_ask_nothing_of_the_map() {
    let truth = drawn(0.1, &[".......", ".#####.", ".#####.", ".#####.", "......."]);
    // Seen from the left only: the near side is drawn, what lies behind it is unknown.
    let map = drawn(0.1, &["....???", ".#?????", ".#?????", ".#?????", "....???"]);
    let score = score_map(&truth, &map, &Pose2::identity(), within(0.0)).unwrap();
    assert_eq!((score.tpr_ratio, score.ppv_ratio, score.f1_ratio), (Some(1.0), Some(1.0), Some(1.0)));
    assert_eq!((score.found_surface_cells, score.unseen_surface_cells), (3, 9));
}

#[test]
fn a_map_in_a_turned_and_moved_frame_is_brought_home_first() {
    let truth = drawn(0.1, &["...........", ".#.......#.", "...........", ".##........", "..........."]);
    // The same place seen from a frame turned by a quarter: rows become columns.
    let truth_from_map = pose2(1.1, 0.0, std::f64::consts::FRAC_PI_2);
    let mut map = Grid::filled(Point2::origin(), 0.1, 5, 11, Cell::Unknown);
    for row in 0..11 {
        for column in 0..5 {
            let at = truth_from_map * map.center_of(column, row);
            let (c, r) = truth.index_of(&at).unwrap();
            *map.get_mut(column, row).unwrap() = *truth.get(c, r).unwrap();
        }
    }
    let (score, verdicts) = compare_maps(&truth, &map, &truth_from_map, within(0.0)).unwrap();
    assert_eq!((score.true_positive_cells, score.true_negative_cells), (4, 51));
    assert_eq!((score.f1_ratio, score.mean_map_error_cells), (Some(1.0), Some(0.0)));
    assert_eq!((verdicts.columns(), verdicts.rows()), (5, 11));
}

#[test]
fn a_finer_truth_loses_no_post_between_the_centers_of_the_map() {
    let mut truth = Grid::filled(Point2::origin(), 0.01, 100, 100, Cell::Free);
    *truth.get_mut(2, 97).unwrap() = Cell::Occupied;
    let mut map = Grid::filled(Point2::origin(), 0.1, 10, 10, Cell::Free);
    *map.get_mut(0, 9).unwrap() = Cell::Occupied;
    let score = score_map(&truth, &map, &Pose2::identity(), within(0.0)).unwrap();
    assert_eq!((score.f1_ratio, score.true_negative_cells), (Some(1.0), 99));
}

#[test]
fn objects_beyond_the_drawn_raster_count_for_distances_and_as_unseen() {
    let mut truth = Grid::filled(Point2::new(-1.0, -1.0), 0.1, 40, 40, Cell::Free);
    *truth.get_mut(6, 12).unwrap() = Cell::Occupied;
    // Cell (0, 0) of the map is cell (10, 10) of the truth; the object lies 4 columns left of it and 2 rows up.
    let map = drawn(0.1, &["...", "...", "#.."]);
    let score = score_map(&truth, &map, &Pose2::identity(), within(0.1)).unwrap();
    assert!((score.mean_map_error_cells.unwrap() - 20.0_f64.sqrt()).abs() < 1e-9);
    assert_eq!((score.unseen_surface_cells, score.tpr_ratio, score.f1_ratio), (1, None, None));
}

#[test]
fn comparisons_without_support_are_refused_or_left_open() {
    let (truth, same) = (drawn(0.1, &POSTS), Pose2::identity());
    let blank = drawn(0.1, &["..", ".."]);
    assert!(matches!(
        score_map(&blank, &truth, &same, within(0.1)),
        Err(ScoreError::EmptyTruth { cells: 4 })
    ));
    let unseen = drawn(0.1, &["??", "??"]);
    let error = score_map(&truth, &unseen, &same, within(0.1)).unwrap_err();
    assert_eq!(error, ScoreError::NoSharedCell { seen: 0 });
    for tolerance_m in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            score_map(&truth, &truth, &same, within(tolerance_m)),
            Err(ScoreError::Setting { .. })
        ));
    }
    let nowhere = pose2(f64::NAN, 0.0, 0.0);
    assert!(matches!(score_map(&truth, &truth, &nowhere, within(0.1)), Err(ScoreError::Setting { .. })));
    for far in [1e5, 1e18, 1e300] {
        let error = score_map(&truth, &truth, &pose2(far, 0.0, 0.0), within(0.1)).unwrap_err();
        assert!(matches!(error, ScoreError::RasterTooLarge { .. }), "{error}");
    }
    let empty = score_map(&truth, &drawn(0.1, &[".......", "......."]), &same, within(0.1)).unwrap();
    assert_eq!((empty.ppv_ratio, empty.mean_map_error_cells, empty.tnr_ratio), (None, None, Some(1.0)));
}
