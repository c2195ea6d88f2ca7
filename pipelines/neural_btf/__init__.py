"""BTFs compressed by a neural network over clustered ABRDFs (paper 1).

M texels, N images (pairs of view and light), k clusters. The ABRDF of a texel is its value in all
images: an (N, 3) array. The arrays' order is (texel, image, channel), texels row by row.
"""
