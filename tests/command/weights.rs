//! Weight files: `supple inspect` tells what is in one, `supple weights` takes it to safetensors and back.

use super::Desk;
use super::networks::described;

#[test]
fn a_network_is_described() {
    let desk = Desk::new();
    desk.network("a.weights", &described(&[7, 20, 3], &[10, 12, 3], 1));
    let said = desk.supple(&["inspect", "a.weights"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    let shown: Vec<String> =
        said.out.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    for line in [
        "weights a.weights",
        "network 7 inputs, 3 outputs, 356 multiply-adds per vertex",
        "step 3.000e-4 s, 10.0 times the exact step it learned from (3.000e-5 s)",
        "learned from exponential, a 59 Pa, b 8.023, d 60000 Pa, 1000 kg/m^3, linear tetrahedra",
        "damping 20 1/s",
        "first 0 7 20 leaky ReLU 0.01 float32 140 640",
        "second 1 12 3 none float32 36 156",
        "displacement, tangent mm 500.0000 -1500.0000 to 2000.0000",
        "acceleration, normal m/s^2 3.0000 -9.0000 to 12.0000",
        "seed = 1",
    ] {
        assert!(shown.iter().any(|shown| shown == line), "{line}: {}", said.out);
    }
    assert!(said.out.contains(&"07".repeat(32)));
    // The name does not matter, the first bytes do.
    std::fs::copy(desk.path("a.weights"), desk.path("a.bin")).unwrap();
    assert_eq!(desk.supple(&["inspect", "a.bin"]).code, 0);
}

#[test]
fn what_cannot_be_used_is_refused_with_its_reason() {
    let desk = Desk::new();
    let path = desk.network("a.weights", &described(&[7, 20, 3], &[], 1));
    let refused = |arguments: &[&str], part: &str| {
        let said = desk.supple(arguments);
        print!("{}", said.err);
        assert_eq!(said.code, 2, "{}", said.err);
        assert!(said.err.contains(part), "{part}: {}", said.err);
    };
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[600] ^= 4;
    std::fs::write(&path, &bytes).unwrap();
    refused(&["inspect", "a.weights"], "a.weights: checksum ");
    refused(&["weights", "export", "a.weights", "--out", "a.safetensors"], "the file says");
    assert!(!desk.path("a.safetensors").exists());
    std::fs::write(&path, &bytes[..500]).unwrap();
    refused(&["inspect", "a.weights"], "a.weights: 500 bytes, a weight file needs ");
    desk.write("a.weights", "[mesh]\n");
    refused(&["inspect", "a.weights"], "a.weights: 7 bytes, a weight file needs 240");
    refused(&["inspect", "none.weights"], "none.weights: cannot be read: ");
    refused(&["weights", "import", "a.weights", "--out", "b.weights"], "a.weights: not a safetensors file: ");
    refused(
        &["inspect", "a.weights", "--accuracy", "1"],
        "--accuracy recommends a step for a scene (.toml), this is a network",
    );
    desk.network("b.weights", &described(&[6, 4, 3], &[], 1));
    refused(
        &["inspect", "b.weights"],
        "b.weights: a network of 6 inputs and 3 outputs; the learned step needs 7 and 3",
    );
}

#[test]
fn weights_go_to_safetensors_and_back() {
    let desk = Desk::new();
    let path = desk.network("a.weights", &described(&[7, 20, 3], &[10, 12, 3], 1));
    let said = desk.supple(&["weights", "export", "a.weights", "--out", "a.safetensors"]);
    print!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    let said = desk.supple(&["weights", "import", "a.safetensors", "--out", "b.weights"]);
    print!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(std::fs::read(path).unwrap() == std::fs::read(desk.path("b.weights")).unwrap());
}
