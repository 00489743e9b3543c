"""Times ONNX Runtime on the shapes of this crate's networks, one thread, 1,458 vertices a call.

    python3 -m venv /tmp/onnx && /tmp/onnx/bin/pip install onnx==1.23.2 onnxruntime==1.31.1 numpy==2.4.6
    /tmp/onnx/bin/python benches/onnx_runtime.py [--against PROGRAM]

Weights are random: time does not depend on them. int8 is ONNX Runtime's own static quantisation, per channel, u8 x s8.
With --against (a build of `cargo bench --bench network`, its path is what `cargo bench --bench network --no-run` prints) both
are run in turn, since a machine that others use changes its speed, and the medians of their ratios are printed.
"""

import argparse
import re
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static

ROWS = 1458
SLOPE = 0.01
SHAPES = {
    "paper": ([7, 256, 256, 128, 64, 32, 3], [10, 64, 64, 64, 3]),
    "compact": ([7, 64, 64, 3], [10, 32, 32, 3]),
}


def network(first, second):
    """Two stacks of dense layers, the second of which sees inputs and what the first predicts; their sum."""
    random = np.random.default_rng(1)
    nodes, weights = [], []

    def stack(name, widths, source):
        for layer, (wide, high) in enumerate(zip(widths, widths[1:])):
            matrix = random.uniform(-1, 1, (wide, high)).astype(np.float32) * np.float32((3 / wide) ** 0.5)
            bias = random.uniform(-0.1, 0.1, high).astype(np.float32)
            at = f"{name}{layer}"
            weights.append(numpy_helper.from_array(matrix, f"{at}.w"))
            weights.append(numpy_helper.from_array(bias, f"{at}.b"))
            nodes.append(helper.make_node("Gemm", [source, f"{at}.w", f"{at}.b"], [at]))
            source = at
            if layer + 2 < len(widths):
                nodes.append(helper.make_node("LeakyRelu", [at], [f"{at}.a"], alpha=SLOPE))
                source = f"{at}.a"
        return source

    predicted = stack("first", first, "x")
    nodes.append(helper.make_node("Concat", ["x", predicted], ["both"], axis=1))
    corrected = stack("second", second, "both")
    nodes.append(helper.make_node("Add", [predicted, corrected], ["y"]))
    graph = helper.make_graph(
        nodes,
        "network",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["rows", first[0]])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["rows", first[-1]])],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 10
    onnx.checker.check_model(model)
    return model


class Samples(CalibrationDataReader):
    """Inputs as they are timed, for the ranges of the activations."""

    def __init__(self, rows):
        self.batches = iter([{"x": rows}])

    def get_next(self):
        return next(self.batches, None)


def session(path):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def microseconds(run, rows, calls=30):
    times = []
    for _ in range(calls):
        start = time.perf_counter()
        run.run(None, {"x": rows})
        times.append(time.perf_counter() - start)
    return 1e6 * statistics.median(times)


def ours(program):
    """Medians that the bench prints, us."""
    text = subprocess.run([program, "--bench", "none"], check=True, capture_output=True, text=True).stdout
    medians = re.findall(r"^(paper|compact)( int8)?: ([0-9.]+) us", text, re.MULTILINE)
    return {(name, bool(quantised)): float(time) for name, quantised, time in medians}


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--against", metavar="PROGRAM")
    against = arguments.parse_args().against
    rows = np.random.default_rng(2).uniform(-1, 1, (ROWS, 7)).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        runs = {}
        for name, (first, second) in SHAPES.items():
            plain, quantised = Path(folder, f"{name}.onnx"), Path(folder, f"{name}-int8.onnx")
            onnx.save(network(first, second), plain)
            quantize_static(
                plain,
                quantised,
                Samples(rows),
                quant_format=QuantFormat.QDQ,
                per_channel=True,
                activation_type=QuantType.QUInt8,
                weight_type=QuantType.QInt8,
            )
            runs[name] = (session(plain), session(quantised))
        rounds = 7 if against else 1
        ratios = {}
        for _ in range(rounds):
            mine = ours(against) if against else {}
            for name, sessions in runs.items():
                times = [microseconds(run, rows) for run in sessions]
                print(f"{name}: ONNX Runtime float32 {times[0]:.0f} us, int8 {times[1]:.0f} us", end="")
                if mine:
                    own = [mine[name, quantised] for quantised in (False, True)]
                    print(f"; supple float32 {own[0]:.0f} us, int8 {own[1]:.0f} us", end="")
                    ratios.setdefault(name, []).append((times[0] / own[0], times[1] / own[1]))
                print()
        for name, pairs in ratios.items():
            plain, quantised = map(statistics.median, zip(*pairs))
            print(f"{name}: supple is {plain:.2f} times as fast in float32, {quantised:.2f} times in int8")


if __name__ == "__main__":
    main()
