use super::*;

/// Long steps, too, carry a weight without an error: only their inertia is another one.
#[test]
fn a_free_body_hangs_on_a_pull_that_carries_its_weight() {
    for (name, method, step) in [("exact", Method::Exact, None), ("long", long(), Some(0.004))] {
        let mut body = bar(Element::NodalStrain, false).with(settings(method, 10.0, step));
        body.gravity = [0.0, 0.0, -9.81];
        let pull = body.pull([0.015, 0.015, 0.12], 0.02, 300.0).unwrap();
        body.pulls[pull].most = f32::INFINITY;
        for _ in 0..300 {
            body.advance(0.01).unwrap();
        }
        let pulled = body.pulled(pull).unwrap();
        let weight = 9.81 * MASS;
        println!("{name}: {:.5} N of {weight:.5} N at a gap of {:.4} mm", pulled.force[2], 1e3 * pulled.gap[2]);
        assert!((pulled.force[2] / weight - 1.0).abs() < 1e-3);
        assert!((pulled.gap[2] / (weight / 300.0) - 1.0).abs() < 1e-3);
    }
}

/// `m x'' = -k x`: a stiff light bar on a soft spring in its middle.
#[test]
fn a_free_body_swings_about_its_target_with_the_period_of_a_spring() {
    let stiffness = 10.0;
    let mut body = bar(Element::Linear, false);
    let at = [0.015, 0.015, 0.06];
    let pull = body.pull(at, 0.07, stiffness).unwrap();
    body.pulls[pull].put([at[0], at[1] + 0.002, at[2]]);
    let (mut last, mut crossings) = (0.0, vec![]);
    while crossings.len() < 3 && body.state().time() < 5.0 {
        body.advance(0.001).unwrap();
        let gap = body.pulled(pull).unwrap().gap[1];
        if last * gap < 0.0 {
            // Where the line through both is zero.
            crossings.push(body.state().time() - 0.001 * f64::from(gap / (gap - last)));
        }
        last = gap;
    }
    let period = crossings[2] - crossings[0];
    let expected = std::f64::consts::TAU * f64::from(MASS / stiffness).sqrt();
    println!("period {:.3} ms, closed form {:.3} ms", 1e3 * period, 1e3 * expected);
    assert!((period / expected - 1.0).abs() < 0.01);
}

/// Nothing damps it but what the pull does by itself: of second order in the step, not of first.
#[test]
fn an_undamped_body_on_a_pull_goes_on_swinging() {
    let (stiffness, way) = (1000.0, 0.002);
    // So stiff that the bar hardly vibrates itself.
    let tissue = VecMaterial::one(Element::Linear, NeoHookean { c: 20_000.0, d: 400_000.0 }, 1000.0);
    let mut body =
        Simulation::new(BAR.points(), BAR.tets(), tissue, &[]).unwrap().with(settings(Method::Exact, 0.0, None));
    let at = [0.015, 0.015, 0.06];
    let pull = body.pull(at, 0.07, stiffness).unwrap();
    body.pulls[pull].most = f32::INFINITY;
    body.pulls[pull].put([at[0], at[1] + way, at[2]]);
    let mut largest_gap = |seconds: f64| {
        let (end, mut largest) = (body.state().time() + seconds, 0.0f32);
        while body.state().time() < end {
            body.advance(0.001).unwrap();
            largest = largest.max(body.pulled(pull).unwrap().gap[1].abs());
        }
        (largest, body.state().last_step())
    };
    let (first, step) = largest_gap(0.1);
    largest_gap(1.8);
    let (last, _) = largest_gap(0.1);
    let of_first_order = (-1.9 * stiffness * step / (2.0 * MASS)).exp();
    println!("amplitude {:.4} of the first after 1.9 s; backward Euler would leave {of_first_order:.2}", last / first);
    assert!(first > 0.9 * way && (last / first - 1.0).abs() < 0.02 && of_first_order < 0.9);
}

#[test]
fn a_pull_along_one_direction_leaves_the_others_free() {
    let mut body = bar(Element::NodalPressure, false).with(settings(Method::Exact, 5.0, None));
    body.gravity = [2.0, 0.0, -9.81];
    let at = [0.015, 0.015, 0.12];
    let pull = body.pull(at, 0.02, 1000.0).unwrap();
    body.pulls[pull].along = [0.0, 0.0, 3.0];
    body.pulls[pull].most = f32::INFINITY;
    for _ in 0..100 {
        body.advance(0.01).unwrap();
    }
    let pulled = body.pulled(pull).unwrap();
    println!("force {:?} N, point {:?} m", pulled.force, pulled.point);
    assert!(pulled.force[0] == 0.0 && (pulled.force[2] / (9.81 * MASS) - 1.0).abs() < 0.05);
    // Half of 2 m/s^2, less what damping takes of it: v = g / mu (1 - exp(-mu t)).
    let way = 2.0 / 5.0 * (1.0 - (1.0 - (-5.0f32).exp()) / 5.0);
    assert!((pulled.point[0] - at[0] - way).abs() < 0.02 * way, "{way}");
}

#[test]
fn a_pull_exerts_no_more_than_its_most_force() {
    for (name, method, step) in [("exact", Method::Exact, None), ("long", long(), Some(0.004))] {
        let mut body = bar(Element::NodalPressure, true).with(settings(method, 20.0, step));
        let pull = body.pull([0.015, 0.015, 0.12], 0.02, 1000.0).unwrap();
        body.pulls[pull].most = 0.02;
        body.pulls[pull].put([0.115, 0.015, 0.12]);
        body.advance(2.0).unwrap();
        let pulled = body.pulled(pull).unwrap();
        println!("{name}: {:.5} N at a gap of {:.1} mm", length(pulled.force), 1e3 * length(pulled.gap));
        assert!((length(pulled.force) / 0.02 - 1.0).abs() < 1e-3 && length(pulled.gap) > 0.02);
    }
}

/// Pulls at the corners of the elements themselves, as springs of supports are, hold them as supports do.
#[test]
fn stiff_springs_hold_a_body_as_supports_do() {
    let hung = |is_fixed: bool, stiffness: f32| {
        let mut body = bar(Element::NodalStrain, is_fixed).with(settings(Method::Exact, 20.0, None));
        body.gravity = [0.0, -0.2, 0.0];
        if !is_fixed {
            for node in 0..25 {
                let at = body.points()[node];
                let pull = body.pull(at, 1e-4, stiffness).unwrap();
                body.pulls[pull].most = f32::INFINITY;
            }
        }
        body.advance(2.0).unwrap();
        body.displacements()[BAR.node(2, 2, 16) as usize].to_array()[1]
    };
    let fixed = hung(true, 0.0);
    let [stiff, soft] = [1e6, 1.0].map(|stiffness| hung(false, stiffness));
    println!(
        "tip: {:.4} mm fixed, {:.4} mm on springs of 1e6 N/m, {:.4} mm on 1 N/m",
        1e3 * fixed,
        1e3 * stiff,
        1e3 * soft
    );
    assert!((stiff / fixed - 1.0).abs() < 2e-3);
    assert!(soft < 1.2 * fixed);
}

#[test]
fn absent_pulls_change_no_bit() {
    let moved = |pulls: usize| {
        let mut body = bar(Element::NodalStrain, true).with(settings(Method::Exact, 5.0, None));
        body.gravity = [0.0, -9.81, 0.0];
        for _ in 0..pulls {
            body.pull([0.015, 0.015, 0.1], 0.02, 0.0).unwrap();
        }
        body.advance(0.05).unwrap();
        body.displacements().to_vec()
    };
    let alone = moved(0);
    assert!(alone.iter().any(|vector| vector.to_array()[1] < -1e-3));
    assert_eq!(alone, moved(2));
}

/// Dynamic relaxation has masses of its own, and comes to where damped exact steps do.
#[test]
fn settling_comes_to_rest_where_damped_steps_do() {
    let at_rest = |settles: bool| {
        let mut body = bar(Element::NodalStrain, false).with(settings(Method::Exact, 20.0, None));
        for (at, target) in [
            ([0.015, 0.0, 0.11], [0.03, 0.0, 0.105]),
            ([0.0, 0.015, 0.06], [0.004, 0.02, 0.06]),
            ([0.03, 0.03, 0.0], [0.03, 0.03, 0.0]),
            ([0.0, 0.0, 0.03], [0.0, 0.0, 0.03]),
        ] {
            let pull = body.pull(at, 0.012, 300.0).unwrap();
            body.pulls[pull].put(target);
        }
        let mut steps = 0;
        if settles {
            let settled = body.settle(1e-5, 5000).unwrap();
            assert!(settled.at_rest, "{settled:?}");
            steps = settled.steps;
        } else {
            for _ in 0..40 {
                body.turn_pulls();
                assert_eq!(body.advance(0.1).unwrap().status, supple::step::Status::Ok);
            }
        }
        (body.displacements().iter().map(|vector| vector.to_array()).collect::<Vec<_>>(), steps)
    };
    let ((damped, _), (settled, steps)) = (at_rest(false), at_rest(true));
    let apart = damped.iter().zip(&settled).map(|(a, b)| length([a[0] - b[0], a[1] - b[1], a[2] - b[2]]));
    let (most, size) = (apart.fold(0.0, f32::max), damped.iter().map(|vector| length(*vector)).fold(0.0, f32::max));
    println!("{:.5} mm apart of {:.2} mm after {steps} steps", 1e3 * most, 1e3 * size);
    assert!(most < 2e-5 && size > 0.005);
}

/// Points of the surface are not in the middle of their nodes.
#[test]
fn the_points_of_a_body_that_turns_turn_with_it() {
    let turned = |degrees: f32| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        move |[x, y, z]: [f32; 3]| [cosine * x - sine * z + 0.01, y - 0.02, sine * x + cosine * z]
    };
    let at = [[0.0, 0.0, 0.0], [0.03, 0.03, 0.0], [0.03, 0.0, 0.12], [0.0, 0.03, 0.12], [0.0, 0.015, 0.06]];
    let drawn = |settles: bool, turns: bool| {
        let mut body = bar(Element::NodalStrain, false).with(settings(Method::Exact, 20.0, None));
        at.iter().for_each(|&at| assert!(body.pull(at, 0.02, 500.0).is_ok()));
        let points = body.points().to_vec();
        let aim = |body: &mut Simulation<'_>, degrees: f32| {
            body.pulls.iter_mut().zip(at).for_each(|(pull, at)| pull.put(turned(degrees)(at)));
        };
        if settles {
            let moved = points.iter().map(|&at| [0, 1, 2].map(|axis| turned(40.0)(at)[axis] - at[axis]));
            body.set_displacements(&moved.collect::<Vec<_>>()).unwrap();
            aim(&mut body, 40.0);
            assert!(body.settle(1e-6, 5000).unwrap().at_rest);
        } else {
            for frame in 0..150_u8 {
                aim(&mut body, 0.5 * f32::from(frame.min(80)));
                if turns {
                    body.turn_pulls();
                }
                assert!(body.advance(1.0 / 60.0).unwrap().is_ok());
            }
        }
        let off = |(at, u): (&[f32; 3], &supple::state::NodeVector)| {
            let (wanted, u) = (turned(40.0)(*at), u.to_array());
            length([0, 1, 2].map(|axis| at[axis] + u[axis] - wanted[axis]))
        };
        points.iter().zip(body.displacements()).map(off).fold(0.0, f32::max)
    };
    let (settled, moved, without) = (drawn(true, true), drawn(false, true), drawn(false, false));
    println!("settled {:.4} mm off, moved {:.4}, points not turned {:.2}", 1e3 * settled, 1e3 * moved, 1e3 * without);
    assert!(settled < 1e-5 && moved < 2e-5 && without > 1e-3);
}

/// The usual limit is that of the tissue at the pull, whatever the order of the elements, and whatever masses it carries.
#[test]
fn the_usual_limit_is_that_of_the_tissue_at_the_pull() {
    let [soft, stiff] =
        [500.0, 5_000.0].map(|c| VecMaterial::one(Element::NodalStrain, NeoHookean { c, d: 20.0 * c }, 1000.0));
    let far =
        |points: &[[f32; 3]], tet: &[u32; 4]| tet.iter().map(|&node| points[node as usize][2]).sum::<f32>() > 0.24;
    let limit = |is_reversed: bool, [near_tissue, far_tissue]: [&VecMaterial; 2]| {
        let (points, mut tets): (Vec<_>, Vec<_>) = (BAR.points().collect(), BAR.tets().collect());
        if is_reversed {
            tets.reverse();
        }
        let mut material = near_tissue.clone();
        material.tissues.push(far_tissue.tissues[0]);
        material.of_element = tets.iter().map(|tet| u16::from(far(&points, tet))).collect();
        let mut bar = Simulation::new(points, tets, material, &[]).unwrap();
        let pull = bar.pull([0.015, 0.015, 0.11], 0.012, 500.0).unwrap();
        bar.pulls[pull].most
    };
    let alone = limit(false, [&stiff, &stiff]);
    let [below, above, reversed] =
        [limit(false, [&soft, &stiff]), limit(false, [&stiff, &soft]), limit(true, [&stiff, &soft])];
    println!(
        "{alone} N in stiff tissue, {above} and {reversed} in soft tissue next to it, {below} next to soft tissue"
    );
    assert!(
        (below / alone - 1.0).abs() < 1e-4
            && (10.0 * above / alone - 1.0).abs() < 1e-4
            && (reversed / above - 1.0).abs() < 1e-5
    );
}

/// Springs in proportion to the masses of the nodes let a body swing as one, however fast: it strains no element.
#[test]
fn springs_swing_a_fast_body_as_one() {
    for element in ELEMENTS {
        for (fastest, rate) in [(0.1, 25.0), (0.3, 25.0)] {
            let mut body = bar(element, false).with(settings(Method::Exact, 0.0, None));
            let amplitude: f32 = fastest / rate;
            for node in 0..body.points().len() {
                let mass = body.scene().view().node_mass(node);
                let spring = body.pull(body.points()[node], 1e-6, rate * rate * mass).unwrap();
                body.pulls[spring].most = f32::INFINITY;
            }
            body.set_displacements(&vec![[amplitude, 0.0, 0.0]; body.points().len()]).unwrap();
            let mut off = 0.0f32;
            for _ in 0..20 {
                body.advance(1.0 / 60.0).unwrap();
                let expected = amplitude * (rate * body.state().time() as f32).cos();
                let far = body.displacements().iter().map(|u| (u.to_array()[0] - expected).abs()).fold(0.0, f32::max);
                off = off.max(far / amplitude);
            }
            println!("{element:?}, up to {fastest} m/s, {rate} 1/s: {:.2} % off", 100.0 * off);
            assert!(off < 0.06);
        }
    }
}
