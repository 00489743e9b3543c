import json
import sys

import torch
from safetensors import safe_open
from torch import nn


class Network(nn.Module):
    """A network that `supple weights export` wrote; its parameters can be trained and imported again."""

    def __init__(self, path):
        super().__init__()
        with safe_open(path, "pt") as file:
            self.about = json.loads(file.metadata()["supple"])
            tensors = {name: file.get_tensor(name) for name in file.keys()}
        for part, slopes in self.about["slopes"].items():
            shapes = [tensors[f"{part}.{index}.weight"].shape for index in range(len(slopes))]
            self.add_module(part, nn.ModuleList(nn.Linear(inputs, outputs) for outputs, inputs in shapes))
        self.load_state_dict(tensors)

    def run_part(self, part, x):
        for layer, slope in zip(getattr(self, part), self.about["slopes"][part]):
            x = layer(x)
            if slope is not None:
                x = nn.functional.leaky_relu(x, slope)
        return x

    def forward(self, x):
        inputs, outputs = self.about["inputs"], self.about["outputs"]
        x = x / torch.tensor(inputs["scale"])
        y = self.run_part("first", x)
        if len(self.second) > 0:
            y = y + self.run_part("second", torch.cat([x, y], dim=-1))
        y = y * torch.tensor(outputs["scale"])
        return torch.clamp(y, torch.tensor(outputs["least"]), torch.tensor(outputs["most"]))


if __name__ == "__main__":
    torch.manual_seed(1)
    network = Network(sys.argv[1])
    scale = torch.tensor(network.about["inputs"]["scale"])
    with torch.no_grad():
        x = 4 * scale * (2 * torch.rand(64, len(scale)) - 1)
        for row in torch.cat([x, network(x)], dim=-1).tolist():
            print(*(f"{value:.9g}" for value in row), sep=",")
