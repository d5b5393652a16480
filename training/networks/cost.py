"""What a network costs: parameters, operations and time, asked as the search asks it."""

import time
from typing import Any

import torch
from torch import nn
from torch.utils.flop_counter import FlopCounterMode

from agents.guided.layers import n_parameters
from agents.guided.nfap import NfapNet

N_REPEATS = 9
BATCHES = (1, 64)


def cost(net: nn.Module) -> dict[str, float]:
    """Parameters, floating-point operations for one input, and milliseconds a batch (of 1 and of 64) as in search.

    In search nFAP-Net is asked for stage 1 only and draws no images. Times are of this machine, on one CPU core.
    """
    n_threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        return _cost(net)
    finally:
        torch.set_num_threads(n_threads)


def _cost(net: nn.Module) -> dict[str, float]:
    work = {"parameters": float(n_parameters(net))}
    net = net.to("cpu").eval()
    pictures = torch.rand(1, _n_inputs(net), net.config.image_size, net.config.image_size)  # type: ignore[union-attr,arg-type]
    with torch.inference_mode():
        counter = FlopCounterMode(display=False)
        with counter:
            net(pictures, *_as_in_search(net, 1))
        work["megaflops"] = counter.get_total_flops() / 1e6
        for n in BATCHES:
            work[f"ms at batch {n}"] = _milliseconds(net, pictures.expand(n, -1, -1, -1).contiguous())
    return work


def _n_inputs(net: nn.Module) -> int:
    return len(net.config.inputs) if isinstance(net, NfapNet) else 2


def _as_in_search(net: nn.Module, n: int) -> tuple[Any, ...]:
    return (torch.zeros(n, net.config.n_told), 1, False) if isinstance(net, NfapNet) else ()


def _milliseconds(net: nn.Module, pictures: torch.Tensor) -> float:
    """The median of a few calls."""
    times = []
    for _ in range(N_REPEATS):
        began = time.perf_counter()
        net(pictures, *_as_in_search(net, len(pictures)))
        times.append(time.perf_counter() - began)
    return 1e3 * sorted(times)[N_REPEATS // 2]
