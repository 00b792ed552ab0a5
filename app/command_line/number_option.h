// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace docent::app {

// Adds an option with `count` numbers between `least` and `most`, which are passed to `take`.
CLI::Option* AddNumbers(CLI::App* command, const std::string& option, int count, double least, double most,
                        const std::function<void(const std::vector<double>&)>& take,
                        const std::string& description);

}  // namespace docent::app
