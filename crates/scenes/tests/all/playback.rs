//! The page that plays a motion: what it holds, what it refuses, and what it does in a real browser.

use crate::browser::Browser;
use crate::motion::playback;
use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::draw::playback::{Drawn, Form, LIMIT, Placed, Playback};
use nonsmooth_scenes::draw::{Drawing, svg};
use serde_json::{Value, json};

/// Sets a control of the page as a hand does.
fn set(browser: &mut Browser, id: &str, property: &str, value: Value) {
    browser.value(&format!(
        "(() => {{ const e = document.getElementById('{id}'); e.{property} = {value}; e.dispatchEvent(new Event('input')); }})()"
    ));
}

fn text(browser: &mut Browser, id: &str) -> String {
    let text = browser.value(&format!("document.getElementById('{id}').textContent"));
    text.as_str().unwrap().into()
}

#[test]
fn the_page_plays_in_a_browser() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&playback(300).html(LIMIT).unwrap());
    assert_eq!(browser.complaints(), [""; 0]);
    assert_eq!(text(&mut browser, "said"), "7 bodies, 300 frames.");
    assert_eq!(browser.value("document.title"), "Everything that moves <b>");
    // The ball touches the ground at a quarter of its period, and only then.
    assert!(text(&mut browser, "key").contains("1 stick2 slip1 open1 near"));
    browser.value("window.view.seek(0.52)");
    assert!(text(&mut browser, "key").contains("1 stick3 slip1 open"));
    assert!(text(&mut browser, "key").ends_with("impulses up to 6.02 N s"));
    assert!(text(&mut browser, "clock").starts_with("0.520 of 2.99 s"));
    // Everything is drawn, and what is switched off is not.
    let drawn = |browser: &mut Browser| browser.value("window.view.drawn()").as_u64().unwrap();
    let arrows = drawn(&mut browser);
    set(&mut browser, "forces", "value", json!("chains"));
    let chains = drawn(&mut browser);
    set(&mut browser, "forces", "value", json!("none"));
    let bare = drawn(&mut browser);
    assert!(bare < chains && bare < arrows, "{bare} {chains} {arrows}");
    set(&mut browser, "contacts", "checked", json!(true));
    assert!(drawn(&mut browser) > bare);
    set(&mut browser, "bodies", "checked", json!(false));
    set(&mut browser, "contacts", "checked", json!(false));
    // The sheet of the ground.
    assert_eq!(drawn(&mut browser), 2);
    set(&mut browser, "bodies", "checked", json!(true));
    // Between frames bodies are between their places.
    let mut at = |t: f64| {
        browser.value(&format!("window.view.seek({t})"));
        browser.value("window.view.at(2)")[0].as_f64().unwrap()
    };
    let (before, between, after) = (at(1.0), at(1.005), at(1.01));
    assert!((between - 0.5 * (before + after)).abs() < 0.1 * (after - before).abs());
    // Whom the view follows stays where it is in the window.
    browser.value("window.view.seek(0)");
    set(&mut browser, "follow", "value", json!("3"));
    let first = browser.value("window.view.at(3)");
    browser.value("window.view.seek(2)");
    let then = browser.value("window.view.at(3)");
    let moved = browser.value("window.view.at(6)");
    assert!((first[0].as_f64().unwrap() - then[0].as_f64().unwrap()).abs() < 1.0, "{first} {then}");
    assert!((moved[0].as_f64().unwrap() - then[0].as_f64().unwrap()).abs() > 1.0);
    // It plays to the end and stops there.
    set(&mut browser, "speed", "value", json!("100"));
    browser.value("document.getElementById('play').click()");
    browser.until("!window.view.playing() && window.view.time() === 2.99");
    // Curves have a line each and a cursor at the time.
    assert_eq!(browser.value("document.querySelectorAll('#plots path.curve').length"), 4);
    let cursor = "document.querySelector('#plots .cursor').getAttribute('x1')";
    let end: f64 = browser.value(cursor).as_str().unwrap().parse().unwrap();
    browser.value("window.view.seek(0)");
    let start: f64 = browser.value(cursor).as_str().unwrap().parse().unwrap();
    assert!(end - start > 300.0, "{start} {end}");
    // The pointer is told what it is at.
    let place = browser.value("window.view.at(6)");
    let event = json!({"type": "mouseMoved", "x": place[0], "y": place[1]});
    browser.call("Input.dispatchMouseEvent", event);
    assert!(text(&mut browser, "tip").starts_with("block, fixed\nx (1.3, 0, 0.3) m"));
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn a_page_of_one_frame_and_nothing_else_complains_of_nothing() {
    let Some(mut browser) = Browser::start() else { return };
    let mut bare = playback(1);
    bare.frames[0].contacts.clear();
    (bare.energy, bare.residual) = (vec![], vec![[0.0, f64::NAN]]);
    browser.open(&bare.html(LIMIT).unwrap());
    browser.value("document.getElementById('play').click()");
    browser.until("!window.view.playing()");
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn frames_are_left_out_until_the_limit_holds() {
    let long = playback(1000);
    let said = |page: &str, key: &str| -> usize {
        let (_, after) = page.split_once(&format!("\"{key}\":")).unwrap();
        after.split(',').next().unwrap().parse().unwrap()
    };
    let whole = long.html(LIMIT).unwrap();
    assert_eq!((said(&whole, "every"), said(&whole, "frames")), (1, 1000));
    let short = long.html(100_000).unwrap();
    // 7 bodies of 20 bytes and 5 contacts of 33 in base64.
    let every = said(&short, "every");
    assert_eq!(every, (1000 * (140 + 165) * 4 / 3_usize).div_ceil(100_000));
    assert_eq!(
        said(&short, "frames"),
        999 / every + 1 + usize::from(!999_usize.is_multiple_of(every))
    );
    assert!(whole.len() - short.len() > 300_000, "{} {}", whole.len(), short.len());
    // Never fewer than the first and the last.
    assert_eq!(said(&long.html(0).unwrap(), "frames"), 2);
    // The page itself is the library, once.
    assert!(whole.len() < 2_000_000, "{}", whole.len());
}

#[test]
fn what_is_not_possible_is_refused_by_its_place() {
    type Spoil = fn(&mut Playback);
    let cases: [(Spoil, &str); 8] = [
        (|p| p.frames.clear(), "frames"),
        (|p| p.bodies.clear(), "bodies"),
        (
            |p| p.bodies[1].parts[0].form = Form::Sphere { radius: -1.0 },
            "bodies[1].parts[0].radius",
        ),
        (|p| p.bodies[2].parts[0].position[1] = f64::NAN, "bodies[2].parts[0]"),
        (|p| p.frames[2].time = 0.0, "frames[2].time"),
        (|p| p.frames[1].poses.truncate(6), "frames[1].poses"),
        (|p| p.frames[1].poses[3].position[0] = f64::INFINITY, "frames[1].poses[3]"),
        (|p| p.frames[1].contacts[0].b = 7, "frames[1].contacts[0].b"),
    ];
    for (spoil, place) in cases {
        let mut spoiled = playback(4);
        spoil(&mut spoiled);
        let message = spoiled.html(LIMIT).unwrap_err().to_string();
        assert!(message.starts_with(place), "{message}");
        assert_eq!(spoiled.picture(0).unwrap_err().to_string(), message);
    }
}

#[test]
fn frames_are_pictures_too() {
    let played = playback(120);
    let picture = played.picture(52).unwrap();
    // The floor is the ground; the block is an obstacle, seen from the other side.
    assert_eq!(picture.bodies.len(), 6);
    assert_eq!(picture.ground.unwrap().normal, [0.0, 0.0, 1.0]);
    let contacts = &picture.frames[0].contacts;
    assert_eq!(contacts.len(), 5);
    let sides: Vec<_> = contacts.iter().map(|c| (c.a, c.b)).collect();
    assert_eq!(sides, [(None, 2), (None, 1), (None, 1), (None, 3), (None, 0)]);
    assert_eq!(contacts[3].frame[0], [0.0, 0.0, -1.0]);
    let drawn = svg(&picture, &Drawing::default()).unwrap();
    assert!(drawn.starts_with("<svg"), "{}", &drawn[..100]);
    assert!(played.picture(120).unwrap_err().to_string().starts_with("frame"));
}

/// A sheet that is bent from frame to frame beside what the others do.
fn bending(frames: usize) -> Playback {
    let mut played = playback(frames);
    let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let form = Form::Mesh { vertices: vertices.clone(), faces: vec![vec![0, 1, 2, 3]] };
    let part = Placed { form, position: [0.0; 3], rotation: Rotation::IDENTITY };
    played.bodies.push(Drawn { name: "sheet".into(), fixed: false, parts: vec![part] });
    for (k, frame) in played.frames.iter_mut().enumerate() {
        let mut shape = vertices.clone();
        shape[2][2] = 0.1 * k as f64;
        frame.poses.push(frame.poses[1].clone());
        frame.shapes = vec![shape];
    }
    played
}

#[test]
fn what_deforms_is_drawn_where_its_vertices_are() {
    let played = bending(4);
    let bodies = played.picture(3).unwrap().bodies;
    let corners = format!("{:?}", bodies.last().unwrap().parts);
    let height = 0.1 * 3.0 - played.frames[3].poses[1].position[2];
    assert!(corners.contains(&format!("{height:?}")), "{height} in {corners}");
    type Spoil = fn(&mut Playback);
    let cases: [(Spoil, &str); 3] = [
        (|p| p.frames[2].shapes.clear(), "frames[2].shapes"),
        (|p| p.frames[1].shapes[0].truncate(3), "frames[1].shapes[0]"),
        (|p| p.frames[1].shapes[0][0][0] = f64::NAN, "frames[1].shapes[0]"),
    ];
    for (spoil, place) in cases {
        let mut spoiled = bending(4);
        spoil(&mut spoiled);
        let message = spoiled.html(LIMIT).unwrap_err().to_string();
        assert!(message.starts_with(place), "{message}");
    }
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&played.html(LIMIT).unwrap());
    let drawn = |browser: &mut Browser| browser.value("window.view.drawn()").as_u64().unwrap();
    assert!(drawn(&mut browser) > 0);
    browser.value("window.view.seek(0.015)");
    assert_eq!(browser.complaints(), [""; 0]);
}
