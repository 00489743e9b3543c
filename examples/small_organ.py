"""A label map of a small organ, for trying the guide without a patient: a bean of 60 x 44 x 36 mm with a notch, label 1, in voxels of
1.5 mm, turned against the axes of the scanner as real scans are.

    python3 examples/small_organ.py organ.nii.gz
"""

import sys

import numpy as np
import SimpleITK as sitk

SPACING = 1.5  # mm
HALF = np.array([30.0, 22.0, 18.0])  # mm


def bean():
    axes = [np.arange(-half - 6.0, half + 6.0, SPACING) for half in HALF]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    ellipsoid = (x / HALF[0]) ** 2 + (y / HALF[1]) ** 2 + (z / HALF[2]) ** 2 < 1.0
    notch = x**2 + (y + 26.0) ** 2 < 12.0**2
    return (ellipsoid & ~notch).astype(np.uint8), [axis[0] for axis in axes]


def main():
    voxels, origin = bean()
    image = sitk.GetImageFromArray(voxels.transpose(2, 1, 0))  # SimpleITK has z first
    image.SetSpacing([SPACING] * 3)
    image.SetOrigin([float(first) for first in origin])
    turn = np.deg2rad(20.0)
    image.SetDirection([np.cos(turn), -np.sin(turn), 0.0, np.sin(turn), np.cos(turn), 0.0, 0.0, 0.0, 1.0])
    sitk.WriteImage(image, sys.argv[1])
    print(f"{sys.argv[1]}: {voxels.sum() * SPACING**3 / 1e3:.1f} cm^3 of label 1")


main()
