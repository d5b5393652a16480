"""Small networks with random weights, made here and quickly."""

from dataclasses import replace
from pathlib import Path

import torch

from agents.choice.config import classes_of
from agents.guided.config import NfapConfig, WarpConfig
from agents.guided.nfap import NfapNet
from agents.guided.warp import WarpNet
from agents.guided.weights import save_weights
from agents.rl.config import NetConfig, SpaceSpec
from agents.rl.network import MeshNet
from agents.rl.weights import save_policy

PAPER = NfapConfig(n=2, image_size=32, feature=16, widths=(4, 4, 8, 8))
RICH = replace(PAPER, inputs=("current", "target", "edges", "vertices"), skips=True, regions="each", residual=True)
TOLD = replace(
    RICH, judge=True, classes=("stop", *classes_of("full", "modeller")), rules=("any", "quads"), w_sc=(0.1, 1.5)
)
SPEC = SpaceSpec(max_vertices=16, obs_resolution=32, max_steps=6)


def make_net(config: NfapConfig = RICH, seed: int = 0) -> NfapNet:
    torch.manual_seed(seed)
    return NfapNet(config).eval()


def saved_networks(folder: Path) -> dict[str, str]:
    """Files of random weights: "nfap", "told" (an nFAP-Net that is told rule and price), "warpnet"."""
    warp = WarpNet(WarpConfig(image_size=32, grid=4, feature=16, widths=(4, 4, 8, 8)))
    labels = {"labels": {"w_sc": 0.3, "temperature": 0.5}}
    return {
        "nfap": str(save_weights(folder / "a.safetensors", make_net(), labels, {})),
        "told": str(save_weights(folder / "c.safetensors", make_net(TOLD), {}, {})),
        "warpnet": str(save_weights(folder / "b.safetensors", warp, {}, {})),
    }


def policy(seed: int = 0, spec: SpaceSpec = SPEC) -> MeshNet:
    """One that has its own mind, and does not stop at once."""
    torch.manual_seed(seed)
    net = MeshNet(NetConfig(widths=(4, 4, 4), width=8, n_rounds=1), spec)
    for parameter in net.action_net.parameters():
        torch.nn.init.normal_(parameter, std=0.5)
    torch.nn.init.constant_(net.action_net.stop[-1].bias, -5.0)
    return net


def saved_policy(folder: Path, spec: SpaceSpec = SPEC) -> str:
    """The file of such a policy."""
    return str(
        save_policy(folder / "policy.safetensors", policy(0, spec), "maskable_ppo", {"why": "a test"}, {"final": 1.0})
    )
