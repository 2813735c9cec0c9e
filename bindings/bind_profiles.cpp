// Floor 3: the IMU noise profiles.
// SPDX-License-Identifier: Apache-2.0
#include "floors.hpp"
#include "liealign/ins/profiles.hpp"

namespace liealign::bindings {

void bind_profiles(py::module_& m) {
  using P = ImuProfile;
  py::class_<P>(m, "ImuProfile",
                "Noise of an IMU by name, in data-sheet units; turn-on biases are one sigma. `source` names the data "
                "sheet,\n"
                "`estimated` the fields that no source prints (\"a, b\"; \"\" for none).")
      .def_readonly("name", &P::name)
      .def_readonly("description", &P::description)
      .def_readonly("gyro_arw_deg_sqrt_h", &P::gyro_arw_deg_sqrt_h)
      .def_readonly("accel_vrw_mps_sqrt_h", &P::accel_vrw_mps_sqrt_h)
      .def_readonly("gyro_bias_instability_deg_h", &P::gyro_bias_instability_deg_h)
      .def_readonly("accel_bias_instability_ug", &P::accel_bias_instability_ug)
      .def_readonly("gyro_bias_turn_on_deg_h", &P::gyro_bias_turn_on_deg_h)
      .def_readonly("accel_bias_turn_on_mg", &P::accel_bias_turn_on_mg)
      .def_readonly("source", &P::source)
      .def_readonly("estimated", &P::estimated);

  m.def("imu_profiles", &imu_profiles,
        "The profiles that `imu.model` names, the default first. docs/imus.md has each number's source.");
}

}  // namespace liealign::bindings
