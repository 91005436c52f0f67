//! The page of a scene in a real browser.

use crate::browser::Browser;
use nonsmooth_problem::check::Motion;
use nonsmooth_scenes::draw::{Answer, Drawing, Picture, html};
use nonsmooth_scenes::{SCENES, SceneEntry};
use serde_json::{Map, Value, json};

fn page(scene: &SceneEntry, solved: bool) -> String {
    let scene = scene.make(&Map::new()).unwrap();
    let picture = Picture::new(&scene).unwrap();
    if !solved {
        return html(&picture, &Drawing::default()).unwrap();
    }
    let nc = scene.contacts.len();
    let r: Vec<f64> = (0..3 * nc).map(|k| (k as f64).cos()).collect();
    let motions: Vec<Motion> =
        (0..nc).map(|c| [Motion::Stick, Motion::Slip, Motion::Open][c % 3]).collect();
    let answer = Answer { r: &r, u: Some(&r), motions: Some(&motions) };
    html(&picture.with(&answer).unwrap(), &Drawing::default()).unwrap()
}

fn point_at(browser: &mut Browser, contact: usize) -> Value {
    let at = browser.value(&format!("window.view.place({contact})"));
    let event = json!({"type": "mouseMoved", "x": at[0], "y": at[1]});
    browser.call("Input.dispatchMouseEvent", event);
    browser.value("document.getElementById('tip').textContent")
}

/// Sets a control of the panel as a hand does.
fn set(browser: &mut Browser, id: &str, property: &str, value: Value) {
    browser.value(&format!(
        "(() => {{ const e = document.getElementById('{id}'); e.{property} = {value}; e.dispatchEvent(new Event('input')); }})()"
    ));
}

#[test]
fn every_scene_is_drawn_without_a_complaint() {
    let Some(mut browser) = Browser::start() else { return };
    for scene in SCENES {
        for solved in [false, true] {
            browser.open(&page(scene, solved));
            assert_eq!(browser.complaints(), [""; 0], "{}", scene.name);
            let triangles = browser.value("window.view.drawn()").as_u64().unwrap();
            assert!(triangles > 10, "{}: {triangles}", scene.name);
        }
    }
}

#[test]
fn the_panel_and_the_pointer_do_what_they_say() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&page(SceneEntry::find("stack").unwrap(), true));
    let drawn = |browser: &mut Browser| browser.value("window.view.drawn()").as_u64().unwrap();
    set(&mut browser, "opacity", "value", json!(0.2));
    set(&mut browser, "contacts", "checked", json!(true));
    let told = point_at(&mut browser, 1);
    assert!(told.as_str().unwrap().starts_with("contact "), "{told}");
    assert!(told.as_str().unwrap().contains("\nr (") && told.as_str().unwrap().contains("\nu ("));
    let before = drawn(&mut browser);
    set(&mut browser, "contacts", "checked", json!(false));
    let without = drawn(&mut browser);
    assert!(without < before, "{without} of {before}");
    set(&mut browser, "forces", "value", json!("none"));
    set(&mut browser, "velocities", "checked", json!(false));
    // Five boxes of twelve triangles.
    assert_eq!(drawn(&mut browser), 60);
    set(&mut browser, "bodies", "checked", json!(false));
    assert_eq!(drawn(&mut browser), 0);
    // Turned by a hand, the same contact is elsewhere; the button brings it back.
    let place = |browser: &mut Browser| browser.value("window.view.place(0)");
    let first = place(&mut browser);
    for (kind, x) in [("mousePressed", 700), ("mouseMoved", 800), ("mouseReleased", 800)] {
        let event = json!({"type": kind, "x": x, "y": 400, "button": "left", "buttons": 1, "clickCount": 1});
        browser.call("Input.dispatchMouseEvent", event);
    }
    let turned = place(&mut browser);
    assert_ne!(first, turned);
    browser.value("document.getElementById('reset').click()");
    let back = place(&mut browser);
    for k in 0..2 {
        let (a, b) = (first[k].as_f64().unwrap(), back[k].as_f64().unwrap());
        assert!((a - b).abs() < 1e-6 * a.abs(), "{first} {back}");
    }
    assert_eq!(browser.complaints(), [""; 0]);
}
