# Limits the memory that decoding a message allocates. The decoders of lcm-gen do not check the counts in a message.
# They resize a vector before they check whether the message contains its elements, and treat a negative string length
# as a huge length. After these changes, a count that exceeds the rest of the message is a decode error. (An array with
# count 0 now also empties the vector; lcm-gen's decoder leaves the elements of the previous message in it.) Used with
# sed -z -E on headers that lcm-gen 1.3 generated. If a pattern does not match, bus_test (MessageLimits) fails.

# Arrays of numbers: each number takes at least one byte.
s/    if\(this->(\w+)\) \{\n        this->(\w+)\.resize\(this->\1\);\n/    if(this->\1 < 0 || this->\1 > maxlen - pos) return -1;\n    this->\2.resize(this->\1);\n    if(this->\1) {\n/g
# Arrays of strings: each takes at least four bytes for its length, and a NUL.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        int32_t __elem_len;\n)/    if(this->\2 < 0 || this->\2 > (maxlen - pos) \/ 5) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# Arrays of structs: each takes at least the size of a struct whose strings and arrays are empty.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        tlen = this->\w+\[a0\]\._decodeNoHash)/    if(this->\2 < 0 || this->\2 > (maxlen - pos) \/ decltype(this->\1)::value_type()._getEncodedSizeNoHash()) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# Arrays of rows of numbers.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        if\([0-9]+\) \{\n)/    if(this->\2 < 0 || this->\2 > maxlen - pos) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# Arrays of rows whose length is another count, which may be 0.
s/    this->(\w+)\.resize\(this->(\w+)\);\n    (for \([^\n]*\n        if\(this->(\w+)\) \{\n)/    if(this->\2 < 0 || this->\4 < 0 || int64_t{this->\2} * (this->\4 ? this->\4 : 1) > maxlen - pos) return -1;\n    this->\1.resize(this->\2);\n    \3/g
# The length of a string includes the terminating NUL. A text that contains another NUL is rejected, because encoding
# would stop there, and the message could not be encoded again.
s/if\((__\w+_len_*) > maxlen - pos\) return -1;/if(\1 < 1 || \1 > maxlen - pos) return -1;\n    if((int32_t) strnlen((const char*)buf + offset + pos, \1) != \1 - 1) return -1;/g
