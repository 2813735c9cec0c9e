// Preintegrated samples, (Eq. 49) and (Eq. 65).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/ins/preintegration.hpp"

namespace liealign {

template void Preintegrated<double>::append(const ImuInput<double>&, double, double);
template void Preintegrated<double>::append(const Preintegrated&);

}  // namespace liealign
