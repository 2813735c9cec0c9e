// The exception family: what was wrong, the value, what is allowed, where, what to do, in one line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace liealign {

// Anything liealign refuses. The front ends map it to exit code 1.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A file or table that cannot be used; the text starts with file:line:column where a reader knows it.
struct InputError : Error {
  using Error::Error;
};

// A configuration key or value that cannot be used; the text names the key.
struct ConfigError : Error {
  using Error::Error;
};

// The computation itself failed (a covariance lost positive definiteness, a state became non-finite): exit code 3.
struct NumericalError : Error {
  using Error::Error;
};

// The progress callback returned false.
struct Cancelled : Error {
  using Error::Error;
};

}  // namespace liealign
