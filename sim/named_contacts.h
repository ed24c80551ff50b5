// Converts the contacts of a source, which names bodies and geoms, to contacts of geoms of MODEL. Pure.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "evalbus/contact_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/source_contact_t.hpp"

namespace evalbus::sim {

class NamedContacts {
 public:
  // A name is looked up first among objects, fixtures and "world", then among bodies, then among geoms. An
  // object, a fixture or the world is represented by its first geom, a body by its first pad geom or, without
  // pads, by its first geom.
  explicit NamedContacts(const model_info_t& info);

  // Returns true if a contact can have this name.
  bool Has(const std::string& name) const { return geoms_.contains(name); }
  std::vector<std::string> Names() const;

  // Returns a description of an unknown name ("there is no object, body or geom 'pott'; did you mean
  // 'pot'?").
  std::string Unknown(const std::string& name) const;
  // Returns a description of what is wrong with the numbers of a contact. Empty if they are valid.
  std::string Fault(const source_contact_t& contact) const;

  // Returns the contacts sorted by (geom_a, geom_b). For two geoms with several contacts, only the deepest is
  // kept. Contacts of a geom with itself are omitted. All contacts must be valid, and their names must be
  // known.
  std::vector<contact_t> Convert(const std::vector<source_contact_t>& contacts) const;

 private:
  std::map<std::string, int> geoms_;
};

}  // namespace evalbus::sim
