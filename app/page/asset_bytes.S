// The bytes behind assets.hpp.
.macro asset name, file
    .global dqw_asset_\name
    .global dqw_asset_\name\()_end
dqw_asset_\name:
    .incbin "\file"
dqw_asset_\name\()_end:
    .byte 0
.endm

    .section .rodata
    asset dygraphs_js, "dygraph.min.js"
    asset dygraphs_css, "dygraph.min.css"
    asset dygraphs_licence, "copyright"
    asset report_css, "page.css"
    asset report_js, "page.js"

    .section .note.GNU-stack, "", %progbits
