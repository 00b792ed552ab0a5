// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/number_option.h"

#include "app/files/text_file.h"

namespace docent::app {

CLI::Option* AddNumbers(CLI::App* command, const std::string& option, int count, double least, double most,
                        const std::function<void(const std::vector<double>&)>& take,
                        const std::string& description) {
  return command
      ->add_option_function<std::vector<std::string>>(
          option,
          [=](const std::vector<std::string>& words) {
            std::vector<double> numbers;
            for (const std::string& word : words) {
              const auto number = ParseNumber(word);
              if (!number || *number < least || *number > most) {
                throw CLI::ValidationError(option, "'" + word + "' is not a number between " +
                                                       FormatNumber(least) + " and " + FormatNumber(most));
              }
              numbers.push_back(*number);
            }
            take(numbers);
          },
          description)
      ->expected(count);
}

}  // namespace docent::app
