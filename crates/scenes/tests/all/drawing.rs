//! Drawings are well formed, stable and refuse what does not fit.

use nonsmooth_problem::check::Motion;
use nonsmooth_scenes::draw::{Answer, Drawing, Picture, Show, View, html, svg};
use nonsmooth_scenes::{SCENES, Scene, SceneEntry};
use serde_json::Map;

fn scenes() -> impl Iterator<Item = Scene> {
    SCENES.iter().map(|s| s.make(&Map::new()).unwrap())
}

/// Some impulses, velocities and statuses at the contacts of a scene.
fn solved(scene: &Scene) -> Picture {
    let nc = scene.contacts.len();
    let r: Vec<f64> = (0..3 * nc).map(|k| (k as f64).cos()).collect();
    let u: Vec<f64> = (0..3 * nc).map(|k| (k as f64).sin()).collect();
    let motions: Vec<Motion> =
        (0..nc).map(|c| [Motion::Open, Motion::Stick, Motion::Slip][c % 3]).collect();
    let answer = Answer { r: &r, u: Some(&u), motions: Some(&motions) };
    Picture::new(scene).unwrap().with(&answer).unwrap()
}

fn bare(scene: &Scene) -> Picture {
    Picture::new(scene).unwrap()
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
        let told = Drawing { caption: Some("impulses < weight & more"), ..Drawing::default() };
        let bodies = Drawing { show: Some(Show::Bodies), ..told.clone() };
        let forces = Drawing { show: Some(Show::Forces), ..told.clone() };
        for (picture, drawing) in [
            (bare(&scene), Drawing::default()),
            (solved(&scene), told),
            (solved(&scene), bodies.clone()),
            (solved(&scene), forces),
        ] {
            let text = svg(&picture, &drawing).unwrap();
            assert_eq!(text, svg(&picture, &drawing).unwrap());
            assert!(text.starts_with("<svg xmlns=") && text.contains("viewBox=\"0 0 800 "));
            assert!(!text.contains("NaN") && !text.contains("inf"));
            let names = elements(&text);
            // White behind everything, on pages of any colour.
            let first = names.iter().position(|n| n == "rect").unwrap();
            assert!(names[..first].iter().all(|n| n == "svg" || n == "title"));
            assert!(text.contains("<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>"));
            if drawing == bodies || drawing == Drawing::default() {
                assert!(names.iter().filter(|n| *n == "circle").count() >= nc);
            }
            // The key, and the caption where there is one.
            assert!(names.contains(&"text".to_string()));
            assert!(drawing.caption.is_none() || text.contains("impulses &lt; weight"));
        }
    }
}

/// The chains of a drawing of forces.
fn chains(text: &str) -> Vec<&str> {
    text.lines()
        .filter(|l| l.contains("stroke-linecap") && !l.contains("stroke=\"#fff\""))
        .collect()
}

#[test]
fn forces_are_chains_as_wide_as_they_are_large() {
    let forces = Drawing { show: Some(Show::Forces), key: false, ..Drawing::default() };
    // Four contacts of a box, the second without impulse, the third pressed by half.
    let scene = scenes().next().unwrap();
    let mut r = [0.0; 12];
    (r[0], r[6], r[9]) = (2.0, 1.0, 2.0);
    let answer = Answer { r: &r, u: None, motions: None };
    let text = svg(&bare(&scene).with(&answer).unwrap(), &forces).unwrap();
    let width = |chain: &&str| -> f64 {
        chain.split_once("stroke-width=\"").unwrap().1.split('"').next().unwrap().parse().unwrap()
    };
    let mut widths: Vec<f64> = chains(&text).iter().map(width).collect();
    widths.sort_by(f64::total_cmp);
    assert!(widths.len() == 3 && widths[1] == widths[2], "{widths:?}");
    assert!((widths[0] - 0.5 * widths[2]).abs() < 0.11, "{widths:?}");
    // A pile hides its forces: they are shown unasked, and there are none before it is solved.
    let pile = SceneEntry::find("sphere_pile").unwrap().make(&Map::new()).unwrap();
    assert!(chains(&svg(&solved(&pile), &Drawing::default()).unwrap()).len() > 100);
    assert!(chains(&svg(&bare(&pile), &Drawing::default()).unwrap()).is_empty());
    let bodies = Drawing { show: Some(Show::Bodies), ..Drawing::default() };
    assert!(chains(&svg(&solved(&pile), &bodies).unwrap()).is_empty());
    let e = svg(&bare(&pile), &forces).unwrap_err().to_string();
    assert_eq!(e, "view: expected impulses, to show forces, found none");
}

#[test]
fn a_page_holds_everything_and_asks_nobody() {
    for scene in scenes() {
        let picture = solved(&scene);
        let page = html(&picture, &Drawing::default()).unwrap();
        assert!(page.contains("default-src 'none'"));
        // What three.js says of its licence is inside the data of its script.
        for address in ["http:", "https:", "src=", "href=", "@import", "url("] {
            assert!(!page.contains(address), "{address}");
        }
        let (_, data) = page.split_once("id=\"data\">").unwrap();
        let data: serde_json::Value =
            serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
        let held = Picture::from_json(&data["picture"].to_string()).unwrap();
        assert_eq!(held.bodies.len(), picture.bodies.len());
        let (held, all) = (&held.frames[0].contacts, &picture.frames[0].contacts);
        assert_eq!(held.len(), scene.contacts.len());
        for (held, one) in held.iter().zip(all) {
            assert_eq!((held.a, held.b, held.status), (one.a, one.b, one.status));
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * (1.0 + b.abs());
            assert!(held.r.unwrap().into_iter().zip(one.r.unwrap()).all(|(a, b)| near(a, b)));
            assert!(held.point.into_iter().zip(one.point).all(|(a, b)| near(a, b)));
        }
    }
}

#[test]
fn a_picture_of_a_picture_is_drawn_and_a_wrong_one_refused() {
    let scene = scenes().next().unwrap();
    let picture = solved(&scene);
    let again = Picture::from_json(&picture.json()).unwrap();
    assert!(svg(&again, &Drawing::default()).unwrap().contains("stroke"));
    assert_eq!(again.json(), picture.json());
    let wrong = |change: &dyn Fn(&mut Picture)| {
        let mut picture = picture.clone();
        change(&mut picture);
        svg(&picture, &Drawing::default()).unwrap_err().to_string()
    };
    let e = wrong(&|p| p.frames[0].contacts[2].b = 7);
    assert_eq!(
        e,
        "frames[0].contacts[2].b: expected one of the 1 bodies that is not fixed, found 7"
    );
    assert!(wrong(&|p| p.frames.clear()).starts_with("frames: expected"));
    assert!(wrong(&|p| p.frames[0].poses.clear()).starts_with("frames[0].poses: expected 1"));
    assert!(
        wrong(&|p| p.frames[0].contacts[0].point[1] = f64::NAN).contains("contacts[0]: expected")
    );
    // Its square has no double.
    let far = wrong(&|p| p.frames[0].poses[0].position[0] = 1e300);
    assert!(far.starts_with("frames[0].poses[0]: expected numbers up to"), "{far}");
    assert!(wrong(&|p| p.bodies[0].parts.clear()).starts_with("bodies[0].parts: expected"));
    assert!(Picture::from_json("{}").unwrap_err().to_string().starts_with("drawing: expected"));
}

#[test]
fn contacts_and_arrows_can_be_left_out() {
    let picture = bare(&scenes().next().unwrap());
    let count = |drawing: &Drawing, name: &str| {
        elements(&svg(&picture, drawing).unwrap()).iter().filter(|n| *n == name).count()
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
    let explained = |picture: &Picture, drawing: &Drawing| {
        let picture = svg(picture, drawing).unwrap();
        let of_key = |piece: &str| Some(piece.split_once("</text>")?.0.to_string());
        let texts = picture.split("text-anchor=\"start\"").skip(1).filter_map(of_key);
        texts.map(|t| t.rsplit('>').next().unwrap().to_string()).collect::<Vec<_>>()
    };
    let all = Drawing::default();
    let velocity = "velocity, up to 1 m/s";
    assert_eq!(explained(&bare(&scene), &all), ["contact", velocity]);
    let none = Drawing { contacts: false, velocities: false, ..all };
    assert!(explained(&bare(&scene), &none).is_empty());
    let motions = [Motion::Slip, Motion::Slip, Motion::Stick, Motion::Slip];
    let answer = Answer { r: &[1.0; 12], u: None, motions: Some(&motions) };
    let solved = bare(&scene).with(&answer).unwrap();
    let still = Drawing { velocities: false, ..Drawing::default() };
    assert_eq!(explained(&solved, &still), ["stick", "slip", "impulse, up to 1.7 N s"]);
    let forces = Drawing { show: Some(Show::Forces), ..Drawing::default() };
    assert_eq!(explained(&solved, &forces), ["stick", "slip", "impulse by width, up to 1.7 N s"]);
    let narrow = svg(&solved, &Drawing { width: 150.0, ..still.clone() }).unwrap();
    let texts = elements(&narrow).iter().filter(|n| *n == "text").count();
    assert_eq!(explained(&solved, &still).len(), texts);
}

#[test]
fn small_marks_have_no_rim() {
    let scene = |rows| {
        let rows = serde_json::json!({"rows": rows, "columns": 2 * rows, "disturbance": 0.1});
        let wall = SceneEntry::find("wall").unwrap().make(rows.as_object().unwrap()).unwrap();
        svg(&bare(&wall), &Drawing { key: false, ..Drawing::default() }).unwrap()
    };
    let rim = "stroke=\"#fff\"";
    assert!(scene(2).contains(rim));
    assert!(!scene(25).contains(rim));
}

#[test]
fn any_sensible_view_is_drawn() {
    for scene in scenes() {
        for (azimuth, elevation, distance) in
            [(0.0, 0.0, 1.5), (200.0, 89.0, 1e4), (90.0, -40.0, 3.0)]
        {
            let view = View { azimuth, elevation, distance };
            let picture = svg(&bare(&scene), &Drawing { view, ..Drawing::default() }).unwrap();
            assert!(!picture.contains("NaN") && !picture.contains("inf"));
        }
    }
}

#[test]
fn what_does_not_fit_the_scene_is_refused() {
    let scene = scenes().next().unwrap();
    let with = |answer: Answer| bare(&scene).with(&answer).unwrap_err().to_string();
    let (r, motions) = ([1.0; 12], [Motion::Open]);
    let e = with(Answer { r: &r[..11], u: None, motions: None });
    assert_eq!(e, "impulses: expected 12 entries, 3 for each contact, found 11");
    let e = with(Answer { r: &r, u: Some(&r[..3]), motions: None });
    assert_eq!(e, "velocities: expected 12 entries, 3 for each contact, found 3");
    let e = with(Answer { r: &r, u: None, motions: Some(&motions) });
    assert_eq!(e, "motions: expected 4 entries, one for each contact, found 1");
    let message = |drawing: Drawing| svg(&bare(&scene), &drawing).unwrap_err().to_string();
    let e = message(Drawing { width: 0.0, ..Drawing::default() });
    assert_eq!(e, "width: expected a positive number, found 0");
    let view = View { elevation: 90.0, ..View::default() };
    assert!(message(Drawing { view, ..Drawing::default() }).starts_with("elevation: expected"));
}
