"""BTFs compressed by a neural network over clustered ABRDFs (docs/btf.md).

M texels, N images (pairs of view and light), k clusters. The ABRDF of a texel is its value in all
images: an (N, 3) array; arrays are (texel, image, channel), texels row by row. Sections, equations
and tables named in this package are those of paper 1, which the page cites. In the order of the
method:

1. ``abrdf``: photographs transposed to ABRDFs (``transposed``), their statistics (Eq. 1-4);
   ``principal_abrdfs``: their principal components, block by block (``summarise_abrdfs``).
2. ``clusters``: k-means++ on the components (``cluster_abrdfs``), or every texel for itself
   (``single_texel_clusters``); ``representatives``: the ABRDF that stands for a cluster.
3. ``training``: encoder, decoder and latents fitted to the ABRDFs (``train``); ``network`` has the
   networks in torch, ``decoder_arrays`` the decoder's size, inputs and values in NumPy,
   ``abrdf_pool`` the part of the matrix that is in memory.
4. ``compressed``: what is kept, and what it decodes to (``CompressedBtf``); ``restoration``: its
   errors against all photographs (``restoration_errors``); ``quality``: figures of it and of any
   rival (``quality``), beside what knows nothing; ``quality_levels``: of far views.
5. ``draping``: a draped cloth of the material under a sky (``draw_frames``); ``material``: what
   else such a picture can be of; ``importance``: directions of light drawn as a material needs.

``orientation`` tells which way up photographs lie in their files, by the ``relief`` that they show.
``compression`` does steps 1 to 4 on photographs in memory by one call (``compress_photographs``).
``pictures`` shows each step; ``figures`` tells whether results are right.
"""
