"""Training of the neural BTF: as the paper trains it, and fast.

``paper``: plain gradient descent on batches of five ABRDFs with all their directions, through the
encoder (section 3.1; batch 5, rate 0.08). Afterwards the latents are what the encoder says.

``fast``: the latents are free variables. They start at the principal components of the ABRDFs
(or at what a briefly trained encoder says, or at random), and are trained with the decoder: its
hidden layers by Muon, the rest by Adam, in large batches, in bfloat16 where the processor
multiplies in it, with a one-cycle rate. A batch is a grid, some texels by some directions, so that
the decoder's first layer is computed once a texel and once a direction. The texels of a cluster
share their latents; the squared error against all of them is that against their mean plus a
constant, so the mean is what is fitted, weighted by the number of texels: the same gradient with
less noise. At the end the encoder is fitted to the latents, so that an ABRDF that was not there can
be encoded without training.

``plan`` says how to train (``TrainingPlan``) and ``data`` what is fitted (``training_data``);
``trainer`` goes through the plan's stages step by step (``train``) with what ``batches`` draws and
``optimisers`` descends by, ``muon`` among them.

Every step draws from a generator seeded by its number: a run that was stopped and resumed gives
what an uninterrupted one gives.
"""
