# Limits on what a message makes its receiver allocate. The decoders of lcm-gen trust the counts in a message: they
# resize a vector before they look whether its elements are there, and take a string of negative length for a huge one.
# After these changes a count that the rest of the message cannot hold is a decode error. (An array of count 0 also
# empties the vector, which lcm-gen leaves as the message before had it.)
# For sed -z -E, on a header of lcm-gen 1.3; bus_test (MessageLimits) fails where it does not fit.

# Numbers: each takes a byte or more.
s/    if\(this->(\w+)\) \{\n        this->(\w+)\.resize\(this->\1\);\n/    if(this->\1 < 0 || this->\1 > maxlen - pos) return -1;\n    this->\2.resize(this->\1);\n    if(this->\1) {\n/g
# Strings: four bytes of length and a NUL each.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        int32_t __elem_len;\n)/    if(this->\2 < 0 || this->\2 > (maxlen - pos) \/ 5) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# Structs: the size of one whose strings and arrays are empty.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        tlen = this->\w+\[a0\]\._decodeNoHash)/    if(this->\2 < 0 || this->\2 > (maxlen - pos) \/ decltype(this->\1)::value_type()._getEncodedSizeNoHash()) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# Rows of numbers.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        if\([0-9]+\) \{\n)/    if(this->\2 < 0 || this->\2 > maxlen - pos) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# Rows whose length is another count, which may be 0.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        if\(this->(\w+)\) \{\n)/    if(this->\2 < 0 || this->\4 < 0 || int64_t{this->\2} * (this->\4 ? this->\4 : 1) > maxlen - pos) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# The length of a string includes the terminating NUL. A text with another NUL inside is refused: encoding would stop
# there, so that the message could not be encoded again.
s/if\((__\w+_len_*) > maxlen - pos\) return -1;/if(\1 < 1 || \1 > maxlen - pos) return -1;\n    if((int32_t) strnlen((const char*)buf + offset + pos, \1) != \1 - 1) return -1;/g
