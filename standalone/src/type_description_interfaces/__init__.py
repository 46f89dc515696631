"""Interface package type_description_interfaces."""
