// liealign._core: the engine for Python. Translation only; python/liealign/_core.pyi says the same in types.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"

PYBIND11_MODULE(_core, m) {
  using namespace liealign::bindings;
  m.doc() = "The liealign engine. Angles in rad and SI units unless a name ends in another unit.";
  m.attr("__version__") = LIEALIGN_VERSION;
#ifdef _OPENMP
  m.attr("has_openmp") = true;
#else
  m.attr("has_openmp") = false;
#endif
  m.attr("has_ceres") = false;
  bind_core(m);
  bind_earth(m);
  bind_profiles(m);
  bind_config(m);
  bind_align(m);
  bind_flight(m);
  bind_pipeline(m);
  bind_simulate(m);
  bind_study(m);
}
