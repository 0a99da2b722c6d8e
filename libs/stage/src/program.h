// What stage.cpp, program.cpp and docs_page.cpp share.
#pragma once

#include <functional>
#include <string>

#include "toile/stage/stage.h"

namespace toile::stage {

void catch_signals();

/// Calls visit(dotted name, field, record that holds it) for every field that has a command-line option: all but records,
/// whose fields take their place. `record` may be null.
void visit_options(const RecordType& type, void* record, const std::string& prefix, const std::function<void(const std::string&, const Field&, void*)>& visit);

/// Options that every program has, with their help.
struct CommonOption {
  const char* name;
  const char* doc;
};
extern const CommonOption common_options[];
extern const std::size_t common_option_count;

/// Exit codes and units, as --help and the docs pages end.
extern const char* const help_footer;

const char* extension(FileKind kind);
std::string type_word(const ValueType& type);

}  // namespace toile::stage
