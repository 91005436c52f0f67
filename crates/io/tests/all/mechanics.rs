//! What a mechanics file of Siconos describes, from files in its layout.

use std::path::Path;

use hdf5_pure::{AttrValue, DatasetBuilder, FileBuilder, GroupBuilder};
use nonsmooth_io::siconos::{MechanicsForm, MechanicsScene};

fn texts(set: &mut DatasetBuilder, texts: &[(&str, &str)]) {
    for (name, text) in texts {
        set.set_attr(name, AttrValue::String((*text).into()));
    }
}

fn reals(set: &mut DatasetBuilder, reals: &[(&str, &[f64])]) {
    for (name, x) in reals {
        set.set_attr(name, AttrValue::F64Array(x.to_vec()));
    }
}

fn object(name: &str, id: i64, fill: impl FnOnce(&mut GroupBuilder)) -> GroupBuilder {
    let mut object = FileBuilder::new().create_group(name);
    object.set_attr("id", AttrValue::I64(id));
    fill(&mut object);
    object
}

/// A file; `fill` adds to its group `data`.
fn file(fill: impl FnOnce(&mut GroupBuilder)) -> Vec<u8> {
    let mut file = FileBuilder::new();
    file.set_attr("dimension", AttrValue::I64(3));
    let mut data = file.create_group("data");
    fill(&mut data);
    file.add_group(data.finish());
    file.finish().unwrap()
}

fn whole() -> Vec<u8> {
    file(|data| {
        let mut shapes = data.create_group("ref");
        let set = shapes.create_dataset("Ball").with_f64_data(&[0.1]).with_shape(&[1, 1]);
        texts(set, &[("type", "primitive"), ("primitive", "Sphere")]);
        set.set_attr("outsideMargin", AttrValue::F64(0.01));
        let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        texts(
            shapes.create_dataset("Stone").with_f64_data(&corners).with_shape(&[4, 3]),
            &[("type", "convex")],
        );
        let ground = shapes
            .create_dataset("Ground")
            .with_f64_data(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
            .with_shape(&[3, 2]);
        texts(ground, &[("type", "heightmap")]);
        reals(ground, &[("rect", &[4.0, 2.0])]);
        texts(shapes.create_dataset("Part").with_u8_data(&[0]), &[("type", "step")]);
        data.add_group(shapes.finish());

        let mut input = data.create_group("input");
        let ball = object("a ball", 2, |ball| {
            ball.set_attr("type", AttrValue::String("dynamic".into()));
            ball.set_attr("mass", AttrValue::F64(2.5));
            ball.set_attr("inertia", AttrValue::F64Array(vec![0.1, 0.2, 0.25]));
            ball.set_attr("translation", AttrValue::F64Array(vec![1.0, 2.0, 3.0]));
            ball.set_attr("orientation", AttrValue::F64Array(vec![0.0, 1.0, 0.0, 0.0]));
            ball.set_attr("velocity", AttrValue::F64Array((0..6).map(f64::from).collect()));
            ball.set_attr("center_of_mass", AttrValue::F64Array(vec![0.5, 0.0, 0.0]));
            ball.set_attr("time_of_birth", AttrValue::F64(0.5));
            let part = ball.create_dataset("Ball-0").with_f64_data(&[]);
            texts(part, &[("shape_name", "Ball")]);
            reals(
                part,
                &[("translation", &[0.5, 0.0, 1.0]), ("orientation", &[1.0, 0.0, 0.0, 0.0])],
            );
            part.set_attr("group", AttrValue::I64(3));
            part.set_attr("parameters", AttrValue::U8Array(vec![128, 4]));
        });
        let grains = object("grains", 1, |grains| {
            grains.set_attr("type", AttrValue::String("dynamic_aggregate".into()));
            grains.set_attr("shape_name", AttrValue::String("Stone".into()));
            grains.set_attr("mass", AttrValue::F64(1.0));
            grains
                .create_dataset("translations")
                .with_f64_data(&[0.0, 0.0, 1.0, 0.0, 0.0, 2.0])
                .with_shape(&[2, 3]);
            grains
                .create_dataset("orientations")
                .with_f64_data(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
                .with_shape(&[2, 4]);
            grains.create_dataset("velocities").with_f64_data(&[0.0; 12]).with_shape(&[2, 6]);
        });
        let floor = object("floor", -1, |floor| {
            texts(floor.create_dataset("Ground-0").with_f64_data(&[]), &[("shape_name", "Ground")]);
        });
        for group in [ball, grains, floor] {
            input.add_group(group.finish());
        }
        data.add_group(input.finish());

        let mut laws = data.create_group("nslaws");
        let law = laws.create_dataset("contact").with_f64_data(&[]);
        texts(law, &[("type", "NewtonImpactFrictionNSL")]);
        for (name, x) in [("mu", 0.3), ("e", 0.1)] {
            law.set_attr(name, AttrValue::F64(x));
        }
        law.set_attr("gid1", AttrValue::I64(0));
        law.set_attr("gid2", AttrValue::I32(3));
        data.add_group(laws.finish());

        let mut joints = data.create_group("joints");
        let hinge = joints.create_dataset("hinge").with_f64_data(&[]);
        texts(hinge, &[("type", "PivotJointR"), ("object1", "a ball")]);
        reals(
            hinge,
            &[
                ("points", &[0.0, 0.0, 1.0]),
                ("axes", &[0.0, 1.0, 0.0]),
                ("stops", &[0.0, -0.5, 1.0, 0.0, 0.5, -1.0]),
            ],
        );
        hinge.set_attr("absolute", AttrValue::U8(0));
        hinge.set_attr("nslaws", AttrValue::String("contact".into()));
        data.add_group(joints.finish());

        let mut others = data.create_group("boundary_conditions");
        others.create_dataset("shaken").with_f64_data(&[]);
        data.add_group(others.finish());
        data.create_dataset("solv")
            .with_f64_data(&[0.01, 1.0, 0.0, 0.0, 0.02, 1.0, 0.0, 0.0, 0.03, 1.0, 0.0, 0.0])
            .with_shape(&[3, 4]);
    })
}

#[test]
fn shapes_objects_laws_and_joints_are_read() {
    let bytes = whole();
    assert!(MechanicsScene::holds(&bytes) && !MechanicsScene::holds(&bytes[..40]));
    let scene = MechanicsScene::parse(Path::new("x"), &bytes).unwrap();
    assert_eq!(scene.dimension, 3);
    let forms: Vec<_> = scene.shapes.iter().map(|s| (s.name.as_str(), &s.form)).collect();
    assert_eq!(*forms[0].1, MechanicsForm::Primitive { kind: "Sphere".into(), size: vec![0.1] });
    assert_eq!(scene.shapes[0].outside_margin, 0.01);
    let heights = vec![vec![0.0, 1.0], vec![2.0, 3.0], vec![4.0, 5.0]];
    assert_eq!(*forms[1].1, MechanicsForm::Heights { heights, size: [4.0, 2.0] });
    assert_eq!(*forms[2].1, MechanicsForm::Other("step".into()));
    assert!(
        matches!(forms[3], ("Stone", MechanicsForm::Convex(points)) if points[3] == [0.0, 0.0, 1.0])
    );

    // Those that stand first, then by their numbers; an aggregate is many.
    let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["floor", "grains 0", "grains 1", "a ball"]);
    let [floor, _, grain, ball] = &scene.objects[..] else { panic!() };
    assert_eq!((floor.mass, floor.rotation), (None, [1.0, 0.0, 0.0, 0.0]));
    assert_eq!((grain.position, grain.contactors[0].shape.as_str()), ([0.0, 0.0, 2.0], "Stone"));
    assert_eq!((ball.mass, ball.birth), (Some(2.5), Some(0.5)));
    assert_eq!(ball.inertia, Some(vec![0.1, 0.2, 0.25]));
    assert_eq!(ball.velocity, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let part = &ball.contactors[0];
    assert_eq!((part.group, part.position), (3, [0.0, 0.0, 1.0]), "from the mass centre");
    assert_eq!(ball.others, ["parameters of Ball-0"]);
    let law = &scene.laws[0];
    assert_eq!((law.mu, law.e, law.groups), (0.3, 0.1, [0, 3]));
    let joint = &scene.joints[0];
    assert_eq!((joint.objects.0.as_str(), &joint.objects.1), ("a ball", &None));
    assert!(!joint.absolute && joint.stops[1] == [0.0, 0.5, -1.0] && joint.laws == ["contact"]);
    assert_eq!(scene.others, ["/data/boundary_conditions/shaken"]);
    let [h, end] = scene.times.unwrap();
    assert!((h - 0.01).abs() < 1e-15 && end == 0.03);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let wrong =
        |bytes: &[u8]| MechanicsScene::parse(Path::new("x"), bytes).unwrap_err().to_string();
    let shape = |fill: fn(&mut DatasetBuilder)| {
        file(|data| {
            let mut shapes = data.create_group("ref");
            fill(shapes.create_dataset("S").with_f64_data(&[1.0]).with_shape(&[1, 1]));
            data.add_group(shapes.finish());
        })
    };
    let none = wrong(&shape(|_| {}));
    assert_eq!(none, "x: /data/ref/S: expected the attribute `type`, found none");
    let number = wrong(&shape(|set| {
        set.set_attr("type", AttrValue::F64(1.0));
    }));
    assert_eq!(number, "x: /data/ref/S: expected a text as `type`, found reals");
    let endless = wrong(&shape(|set| {
        texts(set, &[("type", "convex")]);
        set.set_attr("outsideMargin", AttrValue::F64(f64::NAN));
    }));
    assert!(
        endless.contains("/data/ref/S.outsideMargin[0]: expected a finite number"),
        "{endless}"
    );
    let none = wrong(&FileBuilder::new().finish().unwrap());
    assert!(none.contains("/data: expected a group, found nothing of that name"), "{none}");
    // Damage anywhere is an error or another scene, never a panic.
    let bytes = whole();
    for k in 0..bytes.len() {
        let mut bytes = bytes.clone();
        bytes[k] ^= 1 << (k % 8);
        let _ = MechanicsScene::parse(Path::new("x"), &bytes);
        let _ = MechanicsScene::parse(Path::new("x"), &bytes[..k]);
    }
}
