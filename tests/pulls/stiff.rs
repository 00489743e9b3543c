use super::*;

use crate::support::Backwards;

/// Points of the free bar that is turned, bent, stretched and measured with an error are drawn there from rest: of each
/// element 10 times with other points, stiffnesses of 10 to 1e6 N/m, with exact steps and with long ones.
#[test]
fn no_stiffness_makes_a_step_diverge() {
    let mut random = Random(7);
    for (name, method, multiple) in [("exact", Method::Exact, None), ("long", long(), Some([5.0, 20.0, 50.0]))] {
        let (mut refused, mut runs, mut worst) = (0, 0, 0.0f32);
        for seed in 0..10 {
            for element in ELEMENTS {
                let mut body = bar(element, false);
                let critical = body.critical_step().unwrap().seconds;
                let step = multiple.map(|of: [f32; 3]| of[seed % 3] * critical);
                body.set(settings(method.clone(), 10.0, step));
                let stiffness = 10f32.powf(1.0 + 5.0 * random.next());
                for _ in 0..12 {
                    let [x, y, z] = random.within(BAR.size);
                    let pull = body.pull([x, y, z], 0.012, stiffness).unwrap();
                    let noise = random.within([0.001; 3]).map(|along| along - 0.0005);
                    body.pulls[pull].put([
                        x + 2.0 * z * z + noise[0],
                        0.8 * y - 0.3 * z + noise[1],
                        1.1 * z + noise[2],
                    ]);
                }
                runs += 1;
                for _ in 0..40 {
                    if let Err(error) = body.advance(0.05) {
                        println!("{name}, seed {seed}, {element:?}, {stiffness:.1} N/m: {error}");
                        refused += 1;
                        break;
                    }
                }
                if stiffness > 1000.0 {
                    let gaps = (0..12).map(|pull| length(body.pulled(pull).unwrap().gap));
                    worst = worst.max(gaps.sum::<f32>() / 12.0);
                }
            }
        }
        println!(
            "{name}: {refused} of {runs} runs refused; stiff pulls end {:.2} mm from their targets at most",
            1e3 * worst
        );
        assert_eq!(refused, 0);
        // Not a body that stands still: targets are 15 mm away on average, and some beyond what the most force reaches.
        assert!(worst < 0.0025);
    }
}

#[test]
fn long_steps_come_to_rest_where_exact_ones_do() {
    let at_rest = |method: Method<'static>, multiple: Option<f32>| {
        let mut body = bar(Element::NodalStrain, true);
        let critical = body.critical_step().unwrap().seconds;
        body.set(settings(method, 20.0, multiple.map(|multiple| multiple * critical)));
        for (at, target) in [([0.015, 0.0, 0.11], [0.03, 0.0, 0.105]), ([0.0, 0.015, 0.06], [0.004, 0.02, 0.06])] {
            let pull = body.pull(at, 0.012, 300.0).unwrap();
            body.pulls[pull].put(target);
        }
        for _ in 0..60 {
            body.advance(0.05).unwrap();
        }
        body.displacements().iter().map(|vector| vector.to_array()).collect::<Vec<_>>()
    };
    let exact = at_rest(Method::Exact, None);
    let size = exact.iter().map(|vector| length(*vector)).sum::<f32>() / exact.len() as f32;
    for multiple in [10.0, 20.0] {
        let long = at_rest(long(), Some(multiple));
        let apart = exact.iter().zip(&long).map(|(a, b)| length([a[0] - b[0], a[1] - b[1], a[2] - b[2]]));
        let error = apart.sum::<f32>() / exact.len() as f32;
        println!("{multiple}x: {:.4} mm of {:.2} mm", 1e3 * error, 1e3 * size);
        assert!(error < 0.01 * size);
    }
}

/// A target that moves evenly in each frame, as tracked points do; a third of them is lost in each.
#[test]
fn points_follow_moving_targets_of_which_a_third_is_missing() {
    for (name, method, step) in [("exact", Method::Exact, None), ("long", long(), Some(0.004))] {
        let mut random = Random(3);
        let mut body = bar(Element::NodalStrain, false).with(settings(method, 20.0, step));
        let rest: Vec<_> = (0..12).map(|_| random.within(BAR.size)).collect();
        for &at in &rest {
            body.pull(at, 0.012, 300.0).unwrap();
        }
        let (frame, mut sum, mut frames, mut limited) = (1.0 / 60.0, 0.0, 0.0, 0);
        for number in 0..120 {
            let end = f64::from(number + 1) * frame;
            let shift = [0.01 * (1.5 * end as f32).sin(), 0.0, 0.005 * (3.0 * end as f32).sin()];
            for (pull, at) in body.pulls.iter_mut().zip(&rest) {
                let target = [0, 1, 2].map(|axis| at[axis] + shift[axis]);
                pull.stiffness = if random.next() < 0.3 { 0.0 } else { 300.0 };
                pull.move_to(target, end - frame, end);
            }
            limited += u32::from(!body.advance(frame).unwrap().is_ok());
            if number > 30 {
                let error = |pull: usize| {
                    let point = body.pulled(pull).unwrap().point;
                    length([0, 1, 2].map(|axis| point[axis] - rest[pull][axis] - shift[axis]))
                };
                sum += (0..12).map(error).sum::<f32>() / 12.0;
                frames += 1.0;
            }
        }
        println!(
            "{name}: {:.3} mm from where they are, of 7 mm of motion; {limited} frames limited",
            1e3 * sum / frames
        );
        assert!(sum / frames < 0.0007);
    }
}

#[test]
fn threads_change_no_bit() {
    for method in [Method::Exact, long()] {
        let moved = |threads: bool| {
            let step = (!matches!(method, Method::Exact)).then_some(0.01);
            let mut body = bar(Element::NodalStrain, false).with(settings(method.clone(), 20.0, step));
            for at in [[0.015, 0.0, 0.11], [0.0, 0.015, 0.06], [0.01, 0.015, 0.06]] {
                let pull = body.pull(at, 0.015, 1000.0).unwrap();
                body.pulls[pull].put([at[0] + 0.01, at[1], at[2] - 0.003]);
            }
            let report = if threads { body.advance_in_parts(0.1, &Backwards::new(3)) } else { body.advance(0.1) };
            (body.displacements().to_vec(), body.state().pull_forces().to_vec(), report.unwrap().status)
        };
        let alone = moved(false);
        assert!(length(alone.0[BAR.node(2, 2, 16) as usize].to_array()) > 1e-3);
        assert_eq!(alone, moved(true));
    }
}
