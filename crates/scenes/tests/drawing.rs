//! Drawings are well formed, stable and refuse what does not fit.

use nonsmooth_problem::check::Motion;
use nonsmooth_scenes::draw::{Drawing, View, svg};
use nonsmooth_scenes::{SCENES, Scene};
use serde_json::Map;

fn scenes() -> impl Iterator<Item = Scene> {
    SCENES.iter().map(|s| s.make(&Map::new()).unwrap())
}

/// Tags open and close in order, attributes are quoted, no stray `<` or `&`; returns the names of the elements.
fn elements(xml: &str) -> Vec<String> {
    let (mut open, mut all) = (Vec::new(), Vec::new());
    for piece in xml.split('<').skip(1) {
        let (tag, text) = piece.split_once('>').expect("a tag ends");
        assert!(!text.contains('>'), "{text}");
        let known = |e: &str| ["amp;", "lt;", "gt;"].iter().any(|k| e.starts_with(k));
        assert!(text.split('&').skip(1).all(known), "{text}");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap().to_string();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
            continue;
        }
        if !tag.ends_with('/') {
            open.push(name.clone());
        }
        all.push(name);
    }
    assert!(open.is_empty(), "{open:?}");
    all
}

#[test]
fn every_scene_is_drawn_well_formed_and_stable() {
    for scene in scenes() {
        let nc = scene.contacts.len();
        let impulses: Vec<f64> = (0..3 * nc).map(|k| (k as f64).cos()).collect();
        let motions: Vec<Motion> =
            (0..nc).map(|c| [Motion::Open, Motion::Stick, Motion::Slip][c % 3]).collect();
        let full = Drawing {
            impulses: Some(&impulses),
            motions: Some(&motions),
            caption: Some("impulses < weight & more"),
            ..Drawing::default()
        };
        for drawing in [Drawing::default(), full] {
            let picture = svg(&scene, &drawing).unwrap();
            assert_eq!(picture, svg(&scene, &drawing).unwrap());
            assert!(picture.starts_with("<svg xmlns=") && picture.contains("viewBox=\"0 0 800 "));
            assert!(!picture.contains("NaN") && !picture.contains("inf"));
            let names = elements(&picture);
            assert!(names.iter().filter(|n| *n == "circle").count() >= nc);
            // The key, and the caption where there is one.
            assert!(names.contains(&"text".to_string()));
            assert!(drawing.caption.is_none() || picture.contains("impulses &lt; weight"));
        }
    }
}

#[test]
fn contacts_and_arrows_can_be_left_out() {
    let scene = scenes().next().unwrap();
    let count = |drawing: &Drawing, name: &str| {
        elements(&svg(&scene, drawing).unwrap()).iter().filter(|n| *n == name).count()
    };
    let all = Drawing { key: false, ..Drawing::default() };
    let bare = Drawing { contacts: false, velocities: false, ..all };
    assert_eq!(count(&all, "circle"), 4);
    assert_eq!(count(&bare, "circle"), 0);
    assert_eq!(count(&all, "path") - count(&bare, "path"), 1);
    assert_eq!(count(&all, "text"), 0);
}

#[test]
fn the_key_explains_what_is_shown_and_nothing_else() {
    let scene = scenes().next().unwrap();
    let explained = |drawing: &Drawing| {
        let picture = svg(&scene, drawing).unwrap();
        let of_key = |piece: &str| Some(piece.split_once("</text>")?.0.to_string());
        let texts = picture.split("text-anchor=\"start\"").skip(1).filter_map(of_key);
        texts.map(|t| t.rsplit('>').next().unwrap().to_string()).collect::<Vec<_>>()
    };
    let all = Drawing::default();
    assert_eq!(explained(&all), ["contact", "velocity before the step, up to 1 m/s"]);
    assert!(explained(&Drawing { contacts: false, velocities: false, ..all }).is_empty());
    let impulses = [1.0; 12];
    let motions = [Motion::Slip, Motion::Slip, Motion::Stick, Motion::Slip];
    let solved = Drawing {
        impulses: Some(&impulses),
        motions: Some(&motions),
        velocities: false,
        ..Drawing::default()
    };
    assert_eq!(explained(&solved), ["stick", "slip", "impulse, up to 1.7 N s"]);
    let narrow = svg(&scene, &Drawing { width: 150.0, ..solved.clone() }).unwrap();
    assert_eq!(explained(&solved).len(), elements(&narrow).iter().filter(|n| *n == "text").count());
}

#[test]
fn small_marks_have_no_rim() {
    let scene = |rows| {
        let rows = serde_json::json!({"rows": rows, "columns": 2 * rows, "disturbance": 0.1});
        let wall = nonsmooth_scenes::SceneEntry::find("wall").unwrap();
        svg(
            &wall.make(rows.as_object().unwrap()).unwrap(),
            &Drawing { key: false, ..Drawing::default() },
        )
        .unwrap()
    };
    assert!(scene(2).contains("#fff"));
    assert!(!scene(25).contains("#fff"));
}

#[test]
fn any_sensible_view_is_drawn() {
    for scene in scenes() {
        for (azimuth, elevation, distance) in
            [(0.0, 0.0, 1.5), (200.0, 89.0, 1e4), (90.0, -40.0, 3.0)]
        {
            let view = View { azimuth, elevation, distance };
            let picture = svg(&scene, &Drawing { view, ..Drawing::default() }).unwrap();
            assert!(!picture.contains("NaN") && !picture.contains("inf"));
        }
    }
}

#[test]
fn what_does_not_fit_the_scene_is_refused() {
    let scene = scenes().next().unwrap();
    let message = |drawing: Drawing| svg(&scene, &drawing).unwrap_err().to_string();
    let impulses = [1.0; 11];
    let e = message(Drawing { impulses: Some(&impulses), ..Drawing::default() });
    assert_eq!(e, "impulses: expected 12 entries, 3 for each contact, found 11");
    let e = message(Drawing { motions: Some(&[Motion::Open]), ..Drawing::default() });
    assert_eq!(e, "motions: expected 4 entries, one for each contact, found 1");
    let e = message(Drawing { width: 0.0, ..Drawing::default() });
    assert_eq!(e, "width: expected a positive number, found 0");
    let view = View { elevation: 90.0, ..View::default() };
    assert!(message(Drawing { view, ..Drawing::default() }).starts_with("elevation: expected"));
}
