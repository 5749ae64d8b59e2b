"""Intervals over long records: found by linear programs, proven on a few windows, verified on every sample.

Each end of an interval rests on a handful of samples, and what lies long before them is forgotten like the model's
slowest pole. So three steps suffice, and only the cheap ones read the whole record:

1. `search`: linear programs find the extreme parameters and the samples that hold them. Where noise is on the outputs
   alone (`free_runs`), their unknowns are the parameters; where inputs are noisy too (`noise_programs`), the noises.
2. The intervals are proven on these samples, each with enough samples before it. Fewer equations make the set larger,
   so what is proven on windows holds for the whole record.
3. `whole_record`: every end is met by parameters that are verified to fit all samples. Where one is not, the windows
   grow.
"""
