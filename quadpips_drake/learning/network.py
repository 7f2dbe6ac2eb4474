"""DeepLabV3+ for depth images: atrous spatial pyramid, decoder with skips, and a light backbone.

After Chen et al., "Encoder-Decoder with Atrous Separable Convolution for Semantic Image Segmentation" (2018), the model of
QuadPiPS section V-B.7, in small: the backbone is a stack of inverted residuals (MobileNetV2) of our own, and the image
enters with each 2 x 2 block of pixels folded into channels, so that no layer runs at full resolution.
"""

import torch
from torch import nn
from torch.nn import functional

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.perception.steppability.exported_network import CLASSES, FOLD, STRIDE
from quadpips_drake.perception.steppability.features import CHANNELS


@configuration
class NetworkConfig:
    """Size of the network."""

    stem: int = ranged(32, 1, 1024)
    """Channels at half resolution."""
    widths: list[int] = ranged([32, 64, 96], 1, 1024)
    """Channels at a quarter, an eighth and a sixteenth of the resolution."""
    blocks: list[int] = ranged([2, 4, 6], 1, 32)
    """Inverted residuals at these resolutions."""
    expansion: int = ranged(3, 1, 1024)
    """Channels inside an inverted residual per channel outside."""
    pyramid: int = ranged(96, 1, 1024)
    """Channels of the atrous spatial pyramid."""
    rates: list[int] = ranged([2, 4, 6], 1, 1024)
    """Atrous rates of the pyramid."""
    decoder: int = ranged(32, 1, 1024)
    """Channels of the decoder."""


class SteppabilityNetwork(nn.Module):
    """From features (n, len(CHANNELS), height, width) to logits (n, 3, height, width)."""

    def __init__(self, config: NetworkConfig | None = None):
        super().__init__()
        self.config = config or NetworkConfig()
        c = self.config
        self.stem = nn.Sequential(
            nn.PixelUnshuffle(FOLD), _conv(FOLD**2 * len(CHANNELS), c.stem, 3), _conv(c.stem, c.stem, 3)
        )
        inputs = (c.stem, *c.widths[:2])
        stages = [
            _stage(before, width, count, c.expansion)
            for before, width, count in zip(inputs, c.widths, c.blocks, strict=True)
        ]
        self.quarter, self.eighth, self.sixteenth = stages
        self.pyramid = AtrousPyramid(c.widths[2], c.pyramid, c.rates)
        self.merge_eighth = _Merge(c.pyramid, c.widths[1], 2 * c.decoder)
        self.merge_quarter = _Merge(2 * c.decoder, c.widths[0], c.decoder)
        self.merge_half = _Merge(c.decoder, c.stem, c.decoder)
        self.head = nn.Sequential(nn.Conv2d(c.decoder, FOLD**2 * len(CLASSES), 1), nn.PixelShuffle(FOLD))

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Returns logits of the size of ``features``, whatever size that is."""
        height, width = features.shape[2:]
        padded = functional.pad(features, (0, -width % STRIDE, 0, -height % STRIDE))
        return self.head[1](self.folded_logits(padded))[:, :, :height, :width]

    def folded_logits(self, features: torch.Tensor) -> torch.Tensor:
        """Returns logits as ExportedNetwork does, for each image; sides of ``features`` are multiples of STRIDE."""
        half = self.stem(features)
        quarter = self.quarter(half)
        eighth = self.eighth(quarter)
        x = self.pyramid(self.sixteenth(eighth))
        x = self.merge_eighth(x, eighth)
        x = self.merge_quarter(x, quarter)
        return self.head[0](self.merge_half(x, half))


class InvertedResidual(nn.Module):
    """Expand by 1 x 1, filter every channel by 3 x 3, project by 1 x 1; with a bypass."""

    def __init__(self, channels: int, expansion: int):
        super().__init__()
        inner = expansion * channels
        self.body = nn.Sequential(
            _conv(channels, inner, 1), _conv(inner, inner, 3, groups=inner), _conv(inner, channels, 1, relu=False)
        )

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Returns (n, channels, height, width)."""
        return x + self.body(x)


class AtrousPyramid(nn.Module):
    """Looks at several scales at once: 1 x 1, separable 3 x 3 at several atrous rates, and the mean of the whole image."""

    def __init__(self, inputs: int, outputs: int, rates: tuple[int, ...]):
        super().__init__()
        self.branches = nn.ModuleList([_conv(inputs, outputs, 1), *(_separable(inputs, outputs, rate) for rate in rates)])
        self.whole_image = nn.Sequential(nn.AdaptiveAvgPool2d(1), nn.Conv2d(inputs, outputs, 1), nn.ReLU())
        self.project = _conv((len(rates) + 2) * outputs, outputs, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Returns (n, outputs, height, width)."""
        whole = self.whole_image(x).expand(-1, -1, *x.shape[2:])
        return self.project(torch.cat([*(branch(x) for branch in self.branches), whole], dim=1))


class _Merge(nn.Module):
    """One step of the decoder: doubles the resolution and joins what the encoder had there."""

    def __init__(self, coarse: int, skip: int, outputs: int):
        super().__init__()
        self.lift = _conv(coarse, skip, 1)
        self.join = _separable(2 * skip, outputs)

    def forward(self, coarse: torch.Tensor, skip: torch.Tensor) -> torch.Tensor:
        lifted = functional.interpolate(self.lift(coarse), scale_factor=2, mode="bilinear", align_corners=False)
        return self.join(torch.cat([lifted, skip], dim=1))


def _conv(inputs: int, outputs: int, size: int, *, stride: int = 1, rate: int = 1, groups: int = 1, relu: bool = True):
    padding = rate * (size // 2)
    layers = [
        nn.Conv2d(inputs, outputs, size, stride, padding, rate, groups, bias=False),
        nn.BatchNorm2d(outputs),
    ]
    return nn.Sequential(*layers, nn.ReLU(inplace=True)) if relu else nn.Sequential(*layers)


def _separable(inputs: int, outputs: int, rate: int = 1) -> nn.Sequential:
    return nn.Sequential(_conv(inputs, inputs, 3, rate=rate, groups=inputs), _conv(inputs, outputs, 1))


def _stage(inputs: int, outputs: int, count: int, expansion: int) -> nn.Sequential:
    # A plain convolution halves the resolution: expanded channels at the finer one would cost the most of all layers.
    first = _conv(inputs, outputs, 3, stride=2)
    return nn.Sequential(first, *(InvertedResidual(outputs, expansion) for _ in range(count - 1)))
